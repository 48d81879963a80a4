#define TINYGLTF_IMPLEMENTATION
#include "scene/tinygltf.h"
