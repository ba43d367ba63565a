// Forward declarations, for headers that only name ldi's types.
#pragma once

#include <ldi/base/config.hpp>

#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

enum class error_code;
struct error_details;
class error;

enum class side : std::uint8_t;
class graph;
class graph_view;
class graph_builder;
struct color_column;
struct color16_column;
struct disparity_column;
struct known_column;
struct matte_column;
struct photo_facts;

struct serial_executor;
class thread_pool;
struct progress_listener;

struct pinhole_camera;
struct depth_range;

struct discontinuity_curve;
struct chart;
struct chart_set;
struct textured_mesh;

struct photo3d_options;

}}  // namespace ldi
