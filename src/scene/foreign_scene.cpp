// The bytes of a ForeignScene: every field of every struct, in order. Images are not among them.
#include "base/archive.h"
#include "scene/assimp_reader.h"

namespace lumigrove {

template <class A>
void visit_fields(A& a, Material& m) {
  a(m.name, m.base_color, m.alpha, m.metallic, m.roughness, m.emission, m.normal_scale, m.alpha_cutoff,
    m.alpha_mode, m.double_sided, m.base_color_texture, m.metallic_roughness_texture, m.normal_texture,
    m.emissive_texture);
}
template <class A>
void visit_fields(A& a, Mesh& m) {
  a(m.name, m.positions, m.normals, m.tangents, m.uv0, m.uv1, m.colors, m.triangles, m.material);
}
template <class A>
void visit_fields(A& a, PunctualLight& l) {
  a(l.name, l.type, l.color, l.range, l.inner_cone, l.outer_cone);
}
template <class A>
void visit_fields(A& a, Camera& c) {
  a(c.name, c.vertical_fov, c.znear);
}
template <class A>
void visit_fields(A& a, Node& n) {
  a(n.name, n.parent, n.translation, n.rotation, n.scale, n.has_matrix, n.matrix, n.meshes, n.light,
    n.camera);
}
template <class A>
void visit_fields(A& a, AnimationChannel& c) {
  a(c.node, c.property, c.interpolation, c.times, c.values);
}
template <class A>
void visit_fields(A& a, Animation& animation) {
  a(animation.name, animation.channels);
}
template <class A>
void visit_fields(A& a, ForeignFile& f) {
  a(f.reference, f.embedded, f.width, f.height);
}
template <class A>
void visit_fields(A& a, ForeignScene& f) {
  Scene& s = f.scene;
  a(s.name, s.nodes, s.meshes, s.materials, s.lights, s.cameras, s.animations, s.warnings, f.files,
    f.textures);
}

std::vector<std::uint8_t> to_bytes(ForeignScene& foreign) {
  ArchiveWriter writer;
  writer(foreign);
  return writer.take();
}

ForeignScene from_bytes(const std::vector<std::uint8_t>& bytes) {
  ForeignScene foreign;
  ArchiveReader reader(bytes);
  reader(foreign);
  return foreign;
}

}  // namespace lumigrove
