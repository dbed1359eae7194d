// PartiEMC: temporally stable outlines and light meshes from particles, frame by frame.
//
//   auto reconstructor = partiemc::Reconstructor::Create({.spacing = 0.01});
//   partiemc::State state;          // one per stream
//   partiemc::Workspace workspace;  // one per worker
//   partiemc::Result result;
//   partiemc::Frame frame{.positions = std::span<const float>(xy)};
//   if (auto status = reconstructor->Reconstruct(frame, state, workspace, result); !status.ok())
//   ...
//
// core/METHOD.md describes the method, ARCHITECTURE.md the code.
#pragma once

#include "partiemc/arena.h"
#include "partiemc/doubt.h"
#include "partiemc/frame.h"
#include "partiemc/gauges.h"
#include "partiemc/parameters.h"
#include "partiemc/reconstructor.h"
#include "partiemc/result.h"
#include "partiemc/spacing.h"
#include "partiemc/stage.h"
#include "partiemc/state.h"
#include "partiemc/status.h"
#include "partiemc/surface.h"
#include "partiemc/surface_level.h"
#include "partiemc/validate.h"
