#include "client/output/formats/svg_picture.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "client/output/html.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

// Margin around the box, as a share of its longer side.
constexpr double kMargin = 0.02;

// The legend, in SVG units: its height, and the length of its colour bar.
constexpr double kLegendHeight = 70;
constexpr double kLegendBar = 400;

}  // namespace

Picture::Picture(Box box, double steps) : steps_(steps) {
  if (box.Empty()) box.Include(0, 0);
  double margin = kMargin * box.Side();
  if (!(margin > 0)) margin = 0.5;
  left_ = box.min_x - margin;
  top_ = box.max_y + margin;
  const double width = box.Width() + 2 * margin;
  const double height = box.Height() + 2 * margin;
  scale_ = kLongerSide / std::max(width, height);
  width_ = width * scale_;
  height_ = height * scale_;
}

void Picture::AppendPoint(std::string& out, const double* point) const {
  AppendNumber(out, Round((point[0] - left_) * scale_));
  out += ' ';
  AppendNumber(out, Round((top_ - point[1]) * scale_));
}

// Adding 0 converts -0 to 0.
double Picture::Round(double value) const { return std::round(value * steps_) / steps_ + 0.0; }

std::size_t BandOf(double share) {
  if (!(share > 0)) return 0;
  const double band = std::min(share, 1.0) * kColorBands;
  return std::min(static_cast<std::size_t>(band), kColorBands - 1);
}

double ShareOfBand(std::size_t band) { return (static_cast<double>(band) + .5) / kColorBands; }

void AppendHead(std::string& out, const FrameRecord& frame, const Picture& picture, bool has_legend,
                const std::string& style) {
  out += R"(<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 )";
  AppendNumber(out, picture.width());
  out += ' ';
  AppendNumber(out, picture.height() + (has_legend ? kLegendHeight : 0));
  AppendAll(out, "\">\n<title>Frame ", frame.index, ", time ");
  AppendNumber(out, frame.time);
  AppendAll(out, "</title>\n<style>", style, ".legend{font:22px sans-serif;fill:#333}</style>\n",
            "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n");
}

void AppendLegend(std::string& out, const std::string& name, const ValueRange& range,
                  const Picture& picture) {
  constexpr double kLeft = 20, kBarHeight = 18;
  AppendAll(out, "<g class=\"legend\" transform=\"translate(", kLeft, " ");
  AppendNumber(out, picture.height());
  out += ")\">\n";
  for (std::size_t band = 0; band < kColorBands; ++band) {
    const double step = kLegendBar / kColorBands;
    AppendAll(out, "<rect x=\"", step * static_cast<double>(band), "\" width=\"", step + .5,
              "\" height=\"", kBarHeight, "\" fill=\"", ColorOf(ShareOfBand(band)), "\"/>\n");
  }
  AppendAll(out, "<text y=\"46\">", absl::StrCat(range.low), "</text>\n<text x=\"", kLegendBar,
            "\" y=\"46\" text-anchor=\"end\">", absl::StrCat(range.high), "</text>\n<text x=\"",
            kLegendBar + 20, "\" y=\"17\">", EscapeHtml(name), "</text>\n</g>\n");
}

}  // namespace partiemc::client
