#!/usr/bin/env python3
"""Checks that every public function and class in FOLDERS has a benchmark in ldi_bench, unless EXCEPTIONS lists it.

Reads only sources: declarations that start in the first column of a header, and names of benchmarks ("FOLDER/NAME...") in bench/. A
benchmark counts if its file also uses the name in code. The test cannot tell whether the benchmark measures the right thing."""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
# Maps the first part of a benchmark's name to the folder of headers.
FOLDERS = [(f, f) for f in ("core", "kernels", "networks", "depth", "occlusion", "inpaint", "charts", "texture", "mesh", "render")]
FOLDERS += [("nn", "nn"), ("nn", "nn/ldi"), ("networks", "nn/dense")]

# Names without their own benchmark, by reason.
EXCEPTIONS = {
    "a few instructions": """check_available checked_size vertex_values opposite is_side step_x step_y to_string same_shape focal_length_from_35mm focal_length_from_field_of_view copied
        zeroed first_of averaged is_requantization_scale are_addition_ratios make_requantization make_quantized_addition
        find_instruction_set find_kernel is_available best_isa max_chart_side reach_past_frame beside
        eye_distance max_parallax moved_view motion_of within_motion look_at view_through_window view_on_path view_between frame_within framed""",
    "measured by every function that makes or reads one": """graph graph_view level_map image image_view pixel_region convolution_plan prepared chart_pixels""",
    "measured by the functions of other folders that call it": """check_charts check_disparities check_topology convolution_planner corner_map curve_tracer for_each_other_byte for_each_unknown for_each_piece last_of_run run_precedes""",
    "messages and checks of a file's tensors; read_and_pack of each network includes them": "tensor_place tensor_values check_no_others",
    "layers of networks/farbrausch": "partial_convolution_architecture",
}


def public_names(header):
    """Returns the names of functions and classes that start in the first column, outside namespace detail."""
    names, spaces, depth, statement = set(), [], 0, ""  # spaces: brace depth before each open namespace, and its name
    for line in header.read_text().splitlines():
        line = line.split("//")[0].rstrip()
        if line.startswith("namespace"):
            spaces += [(depth + i, name) for i, name in enumerate(re.findall(r"namespace ([\w:]+) \{", line))]
        elif not line or line[0] in "#}" or re.match(r"(public|private):|using |LDI_|static_assert", line):
            statement = ""
        elif (statement or not line[0].isspace()) and not any(name.startswith("detail") for _, name in spaces):
            statement += " " + line.strip()
            if line.endswith((";", "{", "}")):
                names |= declared_names(statement)
                statement = ""
        depth += line.count("{") - line.count("}")
        spaces = [space for space in spaces if space[0] < depth]
    return names


def declared_names(statement):
    while (shorter := re.sub(r"template <[^<>]*>|<[^<>]*>|requires ?\([^()]*\)", " ", statement)) != statement:
        statement = shorter
    if found := re.match(r" *class (\w+)", statement):
        return {found.group(1)}
    found = re.search(r"(::)?\b([a-z_]\w*)\s*\(", statement)
    is_function = found and not found.group(1) and found.group(2) not in ("requires", "operator") and not re.match(r" *(struct|enum|concept)", statement)
    return {found.group(2)} if is_function else set()


def main():
    sources = {path: path.read_text() for path in sorted((ROOT / "bench").glob("*/*.cpp"))}
    excepted = {name for names in EXCEPTIONS.values() for name in names.split()}
    wrong, used, count = [], set(), 0
    for prefix, folder in FOLDERS:
        for header in sorted((ROOT / "include/ldi" / folder).glob("*.hpp")):
            for name in sorted(public_names(header)):
                registered = re.compile(rf'"{prefix}/{name}(?![a-z_0-9])')
                called = re.compile(rf"(?<![a-z_0-9/\"]){name}\s*[(<{{]|\bldi::{name}\b|\.{name}\b")
                if any(registered.search(text) and called.search(text) for text in sources.values()):
                    count += 1
                    if name in excepted:
                        wrong.append(f"{name} has a benchmark: remove it from EXCEPTIONS")
                elif name in excepted:
                    used.add(name)
                else:
                    wrong.append(f"{header.relative_to(ROOT)}: {name} has no benchmark that starts with \"{prefix}/{name}\"")
    wrong += [f"EXCEPTIONS: {name} is not a public name" for name in sorted(excepted - used) if not any(w.startswith(name + " ") for w in wrong)]
    print(*wrong, sep="\n")
    print(f"{count} names with a benchmark, {len(used)} exceptions, {len(wrong)} wrong")
    return 1 if wrong or count < 100 else 0


sys.exit(main())
