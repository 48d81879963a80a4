// The tables of all measurements and reproductions.
#include "bench.h"
#include "reproduce.h"

namespace lumigrove::bench {

const std::vector<Benchmark>& benchmarks() {
  static const std::vector<Benchmark> table = {
      {"frame.floor.night-city", "ratio",
       "tree, 1280x720, 1 sample a pixel: frame / the same rays through bare Embree", 2.0,
       frame_floor_night_city},
      {"frame.floor.cornell-lights", "ratio", "the same in cornell-lights", 2.0, frame_floor_cornell_lights},
      {"frame.floor.rtslc.cornell-lights", "ratio", "rtslc, 8 samples below shared cuts, likewise", 1.6,
       frame_floor_rtslc_cornell_lights},
      {"frame.floor.pool.cornell-lights", "ratio", "pool, 8 samples below shared cuts, likewise", 1.6,
       frame_floor_pool_cornell_lights},
      {"build.tree.1m", "ratio",
       "whole perfect tree of 1 M emitters / tbb::parallel_sort of its (key, index) pairs", 1.0,
       build_tree_1m},
      {"sample.scaling", "ratio", "time of a light sample among 1 M emitters / among 10 k", 1.5,
       sample_scaling},
      {"memory.per-emitter", "bytes", "light set and tree together, worst of three scenes", 80.0,
       memory_per_emitter},
      {"error.tree-power", "ratio", "RMSE of tree / RMSE of power at equal time in night-city", 0.35,
       error_tree_power},
      {"build.agglomerative", "ratio",
       "agglomerative tree / perfect tree of the lights of cornell-lights; published: about 150", std::nullopt,
       build_agglomerative},
      {"build.saoh", "ratio", "SAOH tree / perfect tree of the lights of cornell-lights", std::nullopt, build_saoh},
      {"sample.light-bvh", "ratio",
       "time of a light sample from the SAOH tree, not split / from the perfect tree of 16 children, cornell-lights",
       std::nullopt, sample_light_bvh},
      {"build.two-level", "ratio",
       "what a frame rebuilds of the two-level tree of night-city / the perfect tree over its emitters", std::nullopt,
       build_two_level},
      {"sample.two-level.night-city", "ratio", "time of a light sample, two-level tree / perfect tree", std::nullopt,
       sample_two_level_night_city},
      {"sample.two-level.cornell-lights", "ratio", "the same in cornell-lights", std::nullopt,
       sample_two_level_cornell_lights},
      {"sample.two-level.cut.night-city", "ratio",
       "rtslc, 1280x720, 8 samples below shared cuts and their shadow rays, two-level tree / perfect tree; published: 1.07",
       std::nullopt, sample_two_level_cut_night_city},
      {"error.two-level.cut", "ratio", "RMSE of the same at equal samples in night-city", std::nullopt,
       error_two_level_cut},
      {"sort.radix.1m", "ratio", "radix sort / tbb::parallel_sort of 1,000,000 (30-bit key, index) pairs",
       0.5, sort_radix_1m},
      {"build.substitute.1m", "ratio",
       "whole substitute tree of 1 M lights / tbb::parallel_sort of its (key, index) pairs", 2.0,
       build_substitute_1m},
      {"build.substitute.growth", "ratio", "time of a substitute tree of 1 M lights / of 100 k", std::nullopt,
       build_substitute_growth},
      {"vpl.trace.night-city", "ratio",
       "tracing of 100 k virtual point lights, 3 a path / the same rays through bare Embree", 2.0,
       vpl_trace_night_city},
      {"vpl.trace.colonnade", "ratio", "the same in colonnade", 2.0, vpl_trace_colonnade},
      {"frame.floor.sst.colonnade", "ratio",
       "sst, 1280x720, 1 sample a pixel, at most 100 k VPLs: frame / the same rays through bare Embree", 1.8,
       frame_floor_sst_colonnade},
      {"frame.floor.sst.living-room", "ratio", "the same in living-room", 1.8, frame_floor_sst_living_room},
      {"memory.per-vpl", "bytes", "VPLs and their tree together, worse of two scenes", 200.0, memory_per_vpl},
      {"sst.steps", "ratio", "mean steps of a walk among at most 100 k VPLs, sst / slc, worse of two scenes", 0.75,
       sst_steps},
      {"sst.growth", "ratio", "time of sst's samples among at most 1 M VPLs / 10 k, worse of two scenes", 1.4, sst_growth},
      {"slc.growth", "ratio", "the same of slc", 2.6, slc_growth},
      {"error.sst-slc", "ratio", "RMSE of sst / of slc at equal time in colonnade, diffuse", std::nullopt, error_sst_slc},
      {"error.sst-path2", "ratio", "RMSE of sst / of path with 2 bounces at equal time in colonnade, diffuse",
       std::nullopt, error_sst_path2},
  };
  return table;
}

const std::vector<Reproduction>& reproductions() {
  static const std::vector<Reproduction> table = {
      {"sst", "W. Tatzgern et al., Stochastic Substitute Trees for Real-Time Global Illumination, I3D 2020", sst_checks()},
      {"rtslc", "D. Lin, C. Yuksel, Real-Time Stochastic Lightcuts, I3D 2020", rtslc_checks()},
  };
  return table;
}

}  // namespace lumigrove::bench
