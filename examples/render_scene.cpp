// Renders a scene file or a built-in scene through the library: render_scene SCENE OUTPUT.exr|.png [SPP]
#include <lumigrove/image.h>
#include <lumigrove/renderer.h>
#include <lumigrove/scene.h>

#include <cstdlib>
#include <iostream>

int main(int argc, char** argv) {
  if (argc < 3) {
    std::cerr << "usage: render_scene SCENE OUTPUT [SPP]\n";
    return 2;
  }
  try {
    const lumigrove::Scene scene = lumigrove::load_scene(argv[1]);

    lumigrove::Settings settings = lumigrove::make_preset("tree");
    settings.width = 640;
    settings.height = 360;
    if (argc > 3) lumigrove::set_value(settings, "spp", argv[3]);

    lumigrove::RenderStats stats;
    const lumigrove::Image image = lumigrove::render(scene, settings, &stats);
    lumigrove::write_image(image, argv[2]);
    std::cout << argv[2] << ": " << stats.emitters << " emitters, " << stats.total_ms << " ms\n";
  } catch (const lumigrove::Error& error) {
    std::cerr << "render_scene: " << error.what() << '\n';
    return 1;
  }
}
