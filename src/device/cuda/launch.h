// The executor on a CUDA device: runs the same kernel structs as device/device.h, one thread for every index.
#pragma once

#include <cuda.h>
#include <cuda_runtime.h>

#include <string>
#include <type_traits>

#include "lumigrove/error.h"

namespace lumigrove::cuda {

// Threads of one block: a multiple of the warp that leaves room for kernels with many registers.
inline constexpr unsigned kBlockSize = 256;

// Throws Error "CUDA: <what> failed: <reason>" unless `status` is success.
inline void check(cudaError_t status, const char* what) {
  if (status != cudaSuccess) throw Error(std::string("CUDA: ") + what + " failed: " + cudaGetErrorString(status));
}

template <class Kernel>
__global__ void run_kernel(int count, const Kernel kernel) {
  // Unsigned, because the last block may reach beyond the largest int.
  const unsigned i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < static_cast<unsigned>(count)) kernel(static_cast<int>(i));
}

// kernel(i) for i in [0, count), in stream order; returns before the device has finished. Everything that the kernel's
// views point to must be readable by the device. Throws Error when the launch is refused; errors while running are
// reported by the next call that waits for the stream.
template <class Kernel>
void launch(int count, const Kernel& kernel, cudaStream_t stream = nullptr) {
  static_assert(std::is_trivially_copyable_v<Kernel>, "a kernel is copied to the device byte by byte");
  if (count <= 0) return;
  const unsigned blocks = (static_cast<unsigned>(count) + kBlockSize - 1) / kBlockSize;
  run_kernel<<<blocks, kBlockSize, 0, stream>>>(count, kernel);
  check(cudaGetLastError(), "kernel launch");
}

}  // namespace lumigrove::cuda
