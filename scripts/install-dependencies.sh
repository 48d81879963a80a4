#!/usr/bin/env bash
# Installs the Debian packages that building Lumigrove needs and, with the argument `tests`, what only its tests need.
# Touches neither network nor disk when all of them are there already, so that it can run before every build.
set -euo pipefail

packages=(
  build-essential cmake ninja-build
  libembree-dev libtbb-dev                     # rays, threads
  libglm-dev                                   # vectors
  libtinygltf-dev nlohmann-json3-dev           # glTF
  libassimp-dev zlib1g-dev                     # OBJ, PLY, FBX; checksums (and Assimp's CMake package links zlib by name)
  libopenimageio-dev openimageio-tools         # images (the CMake package of the former checks for tools of the latter)
  libcli11-dev libspdlog-dev libfmt-dev libtomlplusplus-dev  # command line, log, settings files
  libgtest-dev libbenchmark-dev                # tests, bench
  assimp-testmodels                            # files that the importers are tested with
)
test_packages=(
  chromium chromium-driver python3-selenium    # a browser in which the report of a comparison is tested
)
case "${1:-}" in
  "") ;;
  tests) packages+=("${test_packages[@]}") ;;
  *) echo "install-dependencies: unknown argument '$1'; there is only: tests" >&2; exit 2 ;;
esac

installed() { [ "$(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null)" = installed ]; }

if ! command -v dpkg-query >/dev/null; then
  echo "install-dependencies: this is not a Debian system; install the equivalents of: ${packages[*]}" >&2
  exit 1
fi

missing=()
for package in "${packages[@]}"; do
  installed "$package" || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null || ! sudo -v; then
    echo "install-dependencies: neither root nor sudo is available; ask an administrator to run: apt-get install ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi

echo "Installing ${#missing[@]} Debian packages: ${missing[*]}"
"${as_root[@]}" apt-get update -q
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "${missing[@]}"
