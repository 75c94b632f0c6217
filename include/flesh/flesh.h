/* flesh.h: includes all headers that need no SUNDIALS type. */
#ifndef FLESH_FLESH_H
#define FLESH_FLESH_H

#include "flesh/block_matrix.h"
#include "flesh/body.h"
#include "flesh/contact.h"
#include "flesh/effect.h"
#include "flesh/effects.h"
#include "flesh/fibre.h"
#include "flesh/instructions.h"
#include "flesh/integrator.h"
#include "flesh/linear_solver.h"
#include "flesh/material.h"
#include "flesh/mesh.h"
#include "flesh/motion.h"
#include "flesh/observer.h"
#include "flesh/obstacle.h"
#include "flesh/probe.h"
#include "flesh/ranks.h"
#include "flesh/scene.h"
#include "flesh/sensitivity.h"
#include "flesh/skin.h"
#include "flesh/solver.h"
#include "flesh/state.h"
#include "flesh/status.h"
#include "flesh/surface.h"
#include "flesh/system.h"
#include "flesh/threads.h"
#include "flesh/version.h"

#endif
