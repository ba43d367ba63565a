// All of ldi that works on values in memory. What reads or writes files or third-party formats is left out and included by name:
// ldi/io/..., and ldi/networks/caffe2.hpp for the published weights; link ldi::io for those.
#pragma once

#include <ldi/config.hpp>
#include <ldi/version.hpp>

#include <ldi/core/camera.hpp>
#include <ldi/core/canonical_order.hpp>
#include <ldi/core/coarsening.hpp>
#include <ldi/core/components.hpp>
#include <ldi/core/error.hpp>
#include <ldi/core/executor.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/validate.hpp>
#include <ldi/core/window.hpp>

#include <ldi/kernels/depthwise_u8.hpp>
#include <ldi/kernels/elementwise_u8.hpp>
#include <ldi/kernels/gemm_u8.hpp>
#include <ldi/kernels/requantize.hpp>
#include <ldi/kernels/window_rows.hpp>

#include <ldi/nn/network_description.hpp>

#include <ldi/depth/weighted_median.hpp>

#include <ldi/layers/lift.hpp>

#include <ldi/texture/charts.hpp>

#include <ldi/mesh/textured_mesh.hpp>

#include <ldi/render/camera.hpp>
