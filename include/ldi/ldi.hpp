// All of ldi that works on values in memory. What reads or writes files or third-party formats is left out and included by name:
// ldi/io/..., and ldi/networks/caffe2.hpp for the published weights; link ldi::io for those.
#pragma once

#include <ldi/config.hpp>
#include <ldi/version.hpp>

#include <ldi/core/camera.hpp>
#include <ldi/core/canonical_order.hpp>
#include <ldi/core/coarsening.hpp>
#include <ldi/core/components.hpp>
#include <ldi/core/diffusion.hpp>
#include <ldi/core/error.hpp>
#include <ldi/core/executor.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/validate.hpp>
#include <ldi/core/window.hpp>

#include <ldi/kernels/add_u8.hpp>
#include <ldi/kernels/area_resize.hpp>
#include <ldi/kernels/conv_bf16.hpp>
#include <ldi/kernels/conv_f32.hpp>
#include <ldi/kernels/conv_u8.hpp>
#include <ldi/kernels/depthwise_u8.hpp>
#include <ldi/kernels/gemm_u8.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/kernels/repeat_pixels_u8.hpp>
#include <ldi/kernels/requantize.hpp>
#include <ldi/kernels/requantize_float.hpp>

#include <ldi/nn/convolution_plan.hpp>
#include <ldi/nn/ldi_convolution.hpp>
#include <ldi/nn/network_description.hpp>
#include <ldi/nn/pixel_subset.hpp>
#include <ldi/nn/quantized_network.hpp>
#include <ldi/nn/quantized_weights.hpp>
#include <ldi/nn/weights.hpp>

#include <ldi/networks/farbrausch.hpp>
#include <ldi/networks/tiefenrausch.hpp>

#include <ldi/depth/middle_components.hpp>
#include <ldi/depth/normalize.hpp>
#include <ldi/depth/resample.hpp>
#include <ldi/depth/weighted_median.hpp>

#include <ldi/layers/diffusion_inpainter.hpp>
#include <ldi/layers/discontinuity_curves.hpp>
#include <ldi/layers/expand.hpp>
#include <ldi/layers/grain.hpp>
#include <ldi/layers/lift.hpp>
#include <ldi/layers/mixed_colours.hpp>
#include <ldi/layers/spurious_discontinuities.hpp>

#include <ldi/texture/atlas.hpp>
#include <ldi/texture/charts.hpp>
#include <ldi/texture/packing.hpp>
#include <ldi/texture/padding.hpp>

#include <ldi/mesh/build_mesh.hpp>
#include <ldi/mesh/flat_mesh.hpp>
#include <ldi/mesh/flip.hpp>
#include <ldi/mesh/outlines.hpp>
#include <ldi/mesh/simplify.hpp>
#include <ldi/mesh/studs.hpp>
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/mesh/triangulate.hpp>

#include <ldi/render/camera.hpp>
#include <ldi/render/camera_paths.hpp>
#include <ldi/render/micro_polygons.hpp>
#include <ldi/render/peel.hpp>
#include <ldi/render/rasterizer.hpp>
#include <ldi/render/stereo.hpp>

#include <ldi/photo3d.hpp>
