// Includes all headers that require only the standard library. They suffice to convert a photo's pixels and the bytes of weight
// files to the bytes of a GLB file. Include other headers individually: ldi/io/... for files and decoders (link ldi::io),
// ldi/adapt/... for Eigen and xtensor.
#pragma once

#include <ldi/version.hpp>

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/memory.hpp>
#include <ldi/base/named_tensors.hpp>
#include <ldi/base/progress.hpp>
#include <ldi/base/utf8.hpp>

#include <ldi/core/camera.hpp>
#include <ldi/core/canonical_order.hpp>
#include <ldi/core/coarsening.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/components.hpp>
#include <ldi/core/diffusion.hpp>
#include <ldi/core/discontinuity.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/graph_builder.hpp>
#include <ldi/core/grown_pixels.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/layered_view.hpp>
#include <ldi/core/level_map.hpp>
#include <ldi/core/other_bytes.hpp>
#include <ldi/core/photo_facts.hpp>
#include <ldi/core/pixel_region.hpp>
#include <ldi/core/runs.hpp>
#include <ldi/core/single_layer.hpp>
#include <ldi/core/surface.hpp>
#include <ldi/core/trace_curves.hpp>
#include <ldi/core/validate.hpp>
#include <ldi/core/window.hpp>

#include <ldi/kernels/add_u8.hpp>
#include <ldi/kernels/area_resize.hpp>
#include <ldi/kernels/conv_f32.hpp>
#include <ldi/kernels/conv_u8.hpp>
#include <ldi/kernels/depthwise_u8.hpp>
#include <ldi/kernels/gemm_u8.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/kernels/repeat_pixels_u8.hpp>
#include <ldi/kernels/requantize.hpp>
#include <ldi/kernels/requantize_float.hpp>

#include <ldi/nn/ldi/convolution.hpp>
#include <ldi/nn/ldi/convolution_layer.hpp>
#include <ldi/nn/ldi/convolution_plan.hpp>
#include <ldi/nn/ldi/convolution_planner.hpp>
#include <ldi/nn/ldi/elementwise.hpp>
#include <ldi/nn/ldi/feature_map.hpp>
#include <ldi/nn/ldi/from_column.hpp>
#include <ldi/nn/ldi/pixel_subset.hpp>
#include <ldi/nn/ldi/pooling.hpp>
#include <ldi/nn/ldi/region_plan.hpp>
#include <ldi/nn/ldi/restrict_plan.hpp>
#include <ldi/nn/weights.hpp>

#include <ldi/nn/dense/network_description.hpp>
#include <ldi/nn/dense/quantized_network.hpp>
#include <ldi/nn/dense/quantized_weights.hpp>

#include <ldi/networks/farbrausch.hpp>
#include <ldi/networks/silhouettes.hpp>
#include <ldi/networks/tiefenrausch.hpp>

#include <ldi/depth/align_silhouettes.hpp>
#include <ldi/depth/decided_depth.hpp>
#include <ldi/depth/flakes.hpp>
#include <ldi/depth/level_dips.hpp>
#include <ldi/depth/middle_components.hpp>
#include <ldi/depth/network_decider.hpp>
#include <ldi/depth/normalize.hpp>
#include <ldi/depth/resample.hpp>
#include <ldi/depth/sharpen_edges.hpp>
#include <ldi/depth/step_band.hpp>
#include <ldi/depth/weighted_median.hpp>

#include <ldi/occlusion/discontinuity_curves.hpp>
#include <ldi/occlusion/expand.hpp>
#include <ldi/occlusion/lift.hpp>
#include <ldi/occlusion/past_frame.hpp>
#include <ldi/occlusion/spurious_discontinuities.hpp>

#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/inpaint/grain.hpp>
#include <ldi/inpaint/mixed_colors.hpp>
#include <ldi/inpaint/texture_transfer.hpp>
#include <ldi/inpaint/uncertain_rims.hpp>

#include <ldi/charts/chart_pixels.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/charts/charts.hpp>

#include <ldi/texture/atlas.hpp>
#include <ldi/texture/packing.hpp>
#include <ldi/texture/padding.hpp>
#include <ldi/texture/sheet_layout.hpp>
#include <ldi/texture/sheets.hpp>

#include <ldi/mesh/build_mesh.hpp>
#include <ldi/mesh/flat_mesh.hpp>
#include <ldi/mesh/flip.hpp>
#include <ldi/mesh/gather.hpp>
#include <ldi/mesh/move_to_sheets.hpp>
#include <ldi/mesh/outlines.hpp>
#include <ldi/mesh/polygon.hpp>
#include <ldi/mesh/simplify.hpp>
#include <ldi/mesh/studs.hpp>
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/mesh/triangulate.hpp>

#include <ldi/render/camera.hpp>
#include <ldi/render/camera_paths.hpp>
#include <ldi/render/gap_colors.hpp>
#include <ldi/render/motion.hpp>
#include <ldi/render/rasterizer.hpp>
#include <ldi/render/stereo.hpp>

#include <ldi/formats/checksums.hpp>
#include <ldi/formats/farbrausch.hpp>
#include <ldi/formats/float_map.hpp>
#include <ldi/formats/glb.hpp>
#include <ldi/formats/jpeg_png_header.hpp>
#include <ldi/formats/picture_formats.hpp>
#include <ldi/formats/picture_header.hpp>
#include <ldi/formats/plain_png.hpp>
#include <ldi/formats/safetensors.hpp>
#include <ldi/formats/silhouettes.hpp>
#include <ldi/formats/tiefenrausch.hpp>

#include <ldi/photo3d/clean_depth.hpp>
#include <ldi/photo3d/lift_photo.hpp>
#include <ldi/photo3d/options.hpp>
#include <ldi/photo3d/paper_options.hpp>
#include <ldi/photo3d/suppliers.hpp>

#include <ldi/photo3d.hpp>
