#include "client/evaluation/scenes/motion.h"

#include <cmath>
#include <utility>

#include "client/evaluation/scenes/trigonometry.h"

namespace partiemc::evaluation {
namespace {

class SimilaritySteps : public Motion {
 public:
  explicit SimilaritySteps(std::vector<Similarity> steps) : steps_(std::move(steps)) {}
  void Carry(std::size_t frame, std::span<Point> points) const override {
    for (Point& p : points) p = steps_[frame](p);
  }

 private:
  std::vector<Similarity> steps_;
};

class FlowSteps : public Motion {
 public:
  explicit FlowSteps(std::vector<FlowStep> steps) : steps_(std::move(steps)) {}
  void Carry(std::size_t frame, std::span<Point> points) const override {
    const FlowStep& step = steps_[frame];
    for (Point& p : points) {
      for (const FlowStep::Shear& shear : step.shears) {
        const double across = Cross(shear.along, p);
        p = p + (shear.amplitude * Sine(shear.wavenumber * across + shear.phase)) * shear.along;
      }
      const Point arm = p - step.vortex_center;
      const double rest = 1 - Dot(arm, arm) / (step.vortex_radius * step.vortex_radius);
      if (rest <= 0) continue;
      // The angle depends on the radius only, so that rings around the centre slide on each other.
      const Direction d = DirectionOf(step.vortex_angle * rest * rest);
      p = Similarity{d.cosine, d.sine, 1, step.vortex_center}(arm);
    }
  }

 private:
  std::vector<FlowStep> steps_;
};

class MovingBodies : public Motion {
 public:
  explicit MovingBodies(std::vector<Body> bodies) : bodies_(std::move(bodies)) {}
  void Carry(std::size_t frame, std::span<Point> points) const override {
    for (Point& p : points) {
      const Body* nearest = &bodies_[0];
      for (const Body& body : bodies_) {
        if (std::abs(body.Distance(frame, p)) < std::abs(nearest->Distance(frame, p))) {
          nearest = &body;
        }
      }
      p = p + nearest->step;
    }
  }

 private:
  std::vector<Body> bodies_;
};

class OtherUnits : public Motion {
 public:
  OtherUnits(SharedMotion motion, const Similarity& units)
      : motion_(std::move(motion)), units_(units) {}
  void Carry(std::size_t frame, std::span<Point> points) const override {
    for (Point& p : points) p = units_.Inverse(p);
    motion_->Carry(frame, points);
    for (Point& p : points) p = units_(p);
  }

 private:
  SharedMotion motion_;
  Similarity units_;
};

}  // namespace

double Body::Distance(std::size_t frame, Point p) const {
  const Direction turn = DirectionOf(angle);
  const Point arm = p - CenterAt(frame);
  const Point q = {(turn.cosine * arm.x + turn.sine * arm.y) / a,
                   (turn.cosine * arm.y - turn.sine * arm.x) / b};
  const double radius = Length(q);  // 1 on the ellipse.
  if (radius == 0) return -std::fmin(a, b);
  const double slope = Length({q.x / a, q.y / b}) / radius;
  return (radius - 1) / slope;
}

SharedMotion SimilarityMotion(std::vector<Similarity> steps) {
  return std::make_shared<SimilaritySteps>(std::move(steps));
}

SharedMotion FlowMotion(std::vector<FlowStep> steps) {
  return std::make_shared<FlowSteps>(std::move(steps));
}

SharedMotion BodiesMotion(std::vector<Body> bodies) {
  return std::make_shared<MovingBodies>(std::move(bodies));
}

SharedMotion InUnits(SharedMotion motion, const Similarity& units) {
  return std::make_shared<OtherUnits>(std::move(motion), units);
}

}  // namespace partiemc::evaluation
