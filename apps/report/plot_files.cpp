#include "plot_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "base/atomic_file.h"
#include "plot.h"

namespace lumigrove {

void write_plots(const Results& results, const std::filesystem::path& folder) {
  std::set<std::string> lights;
  for (const CurveBand& band : curve_bands(results))
    lights.insert(results.methods[static_cast<std::size_t>(band.method)].light);
  if (lights.empty()) return;
  std::filesystem::create_directories(folder / "plots");
  for (const std::string& light : lights)
    for (const Budget against : kBudgets) {
      std::string name = fmt::format("{}.{}.svg", budget_key(against), light);
      std::replace(name.begin(), name.end(), ' ', '-');
      write_text_atomically(folder / "plots" / ("rmse-" + name), standalone_svg(convergence_plot(results, light, Measure::kRmse, against)));
      write_text_atomically(folder / "plots" / ("relmse-" + name),
                 standalone_svg(convergence_plot(results, light, Measure::kRelMse, against)));
    }
}

}  // namespace lumigrove
