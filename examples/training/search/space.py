"""The design space: networks of TR blocks (as in the paper) and dense blocks, around the shipped network (tiefenrausch_small/model.py).

A member is one network of the space: a tuple of choices, one per gene. A block's signature (kind, inputs, outputs, expansion, stride, height,
width) is its key in the latency table.
"""
import functools
import os
import sys

sys.path[:0] = [os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "tiefenrausch_small")]
from model import Addition, Builder, Convolution  # noqa: E402

HEIGHT, WIDTH = 288, 384  # network input for which latency is measured
LEVELS = 6  # levels of resolution, from full to 1/32

# Encoder, one stage per entry: channels, stride. Each stage also chooses expansion, blocks, and the kernel of the expanding convolution: 1
# is the paper's TR block (1 x 1, depthwise 3 x 3, 1 x 1); 3 is the fused one (dense 3 x 3, 1 x 1). The library's depthwise kernel is 3 x 3.
DOWN = (((16, 24, 32), 2), ((24, 32, 48), 2), ((32, 64, 96), 2), ((64, 96, 128), 1), ((96, 160, 192), 2))
EXPANSIONS, BLOCKS_DOWN, KERNELS = (2, 4, 6), (1, 2, 3, 4), (1, 3)
# Decoder, per level 1 to 5: channels, and kind and number of the refining blocks.
UP = ((16, 24, 32), (32, 48, 64), (48, 64, 96), (64, 96, 128), (96, 128, 160))
REFINE, BLOCKS_UP = ("dense", "tr2", "tr4"), (0, 1, 2)
STEM, FIRST, FULL = (16, 24, 32), (8, 16), (8, 16)  # channels: first convolution, first TR block, convolution at full resolution

GENES = {"stem": STEM, "first": FIRST}
for _i, (_channels, _) in enumerate(DOWN):
    GENES.update({f"down{_i}.channels": _channels, f"down{_i}.expansion": EXPANSIONS, f"down{_i}.blocks": BLOCKS_DOWN, f"down{_i}.kernel": KERNELS})
GENES["up0.channels"] = FULL
for _i, _channels in enumerate(UP):
    GENES.update({f"up{_i + 1}.channels": _channels, f"up{_i + 1}.refine": REFINE, f"up{_i + 1}.blocks": BLOCKS_UP})
NAMES = tuple(GENES)

# The shipped network.
SHIPPED = (32, 16, 24, 6, 2, 1, 32, 6, 3, 1, 64, 6, 4, 1, 96, 6, 3, 1, 160, 6, 3, 1, 8, 24, "dense", 1, 48, "dense", 1, 64, "dense", 1,
           96, "dense", 1, 128, "dense", 2)


def size():
    """Returns the number of networks in the space."""
    product = 1
    for choices in GENES.values():
        product *= len(choices)
    return product


def random_member(rng):
    return tuple(choices[rng.integers(len(choices))] for choices in GENES.values())


def mutated(rng, member, count=2):
    """Returns a copy of the member with `count` genes redrawn at random."""
    genes = list(member)
    for i in rng.choice(len(genes), count, replace=False):
        choices = GENES[NAMES[i]]
        genes[i] = choices[rng.integers(len(choices))]
    return tuple(genes)


def crossed(rng, a, b):
    return tuple(x if rng.random() < 0.5 else y for x, y in zip(a, b))


class Blocks(Builder):
    """Builds a network block by block, and lists its operators and the signatures of its blocks."""

    def __init__(self, channels=3, height=HEIGHT, width=WIDTH):
        super().__init__()
        self.channels["photo"], self.sizes, self.signatures = channels, {"photo": (height, width)}, []

    def block(self, name, x, kind, outputs, expansion=1, stride=1, relu=False):
        """Appends a block and returns its output tensor."""
        height, width = self.sizes[x]
        self.signatures.append((kind, self.channels[x], outputs, expansion, stride, height, width))
        if kind == "tr":
            y = self.inverted_residual(name, x, outputs, expansion, stride, normalized=True)
        elif kind == "fused":
            y = self.convolution(name + ".expand", x, self.channels[x] * expansion, 3, stride, relu=True)
            y = self.convolution(name + ".project", y, outputs)
            y = self.addition(name + ".sum", x, y) if stride == 1 and outputs == self.channels[x] else y
        elif kind == "dense":
            y = self.residual(name, x)
        elif kind == "up":
            y = self.enlargement(name, self.convolution(name + ".convolution", x, outputs, 3))
        elif kind == "head":
            detail = self.convolution("detail", self.convolution("last", x, outputs, 3, relu=True), 1, 3, normalized=False)
            y = self.addition("disparity", self.convolution("direct", x, 1, 3, normalized=False), detail)
        else:  # "conv1", "conv3"
            y = self.convolution(name, x, outputs, int(kind[-1]), stride, relu=relu)
        self.sizes[y] = (2 * height, 2 * width) if kind == "up" else (height // stride, width // stride)
        return y


@functools.lru_cache(1)  # successive calls have the same argument
def built(member):
    """Returns the member's Blocks, whose operators model.Student accepts."""
    g, b = dict(zip(NAMES, member)), Blocks()
    full = b.block("full", "photo", "conv3", g["up0.channels"], relu=True)
    x, levels = b.block("stem", "photo", "conv3", g["stem"], stride=2, relu=True), [full]
    x = b.block("first", x, "tr", g["first"])
    for i, (_, stride) in enumerate(DOWN):
        if stride == 2:
            levels.append(x)
        for j in range(g[f"down{i}.blocks"]):
            x = b.block(f"down{i}.{j}", x, "tr" if g[f"down{i}.kernel"] == 1 else "fused", g[f"down{i}.channels"], g[f"down{i}.expansion"],
                        stride if j == 0 else 1)
    levels.append(x)
    y = b.block("context", x, "conv1", g["up5.channels"], relu=True)
    for level in range(LEVELS - 1, -1, -1):
        if level < LEVELS - 1:
            y = b.block(f"up{level}", y, "up", g[f"up{level}.channels"])
            skip = full if level == 0 else b.block(f"skip{level}", levels[level], "conv1", g[f"up{level}.channels"])
            merged = b.addition(f"merge{level}", skip, y)
            b.sizes[merged] = b.sizes[y]
            y = merged
        for i in range(g[f"up{level}.blocks"] if level else 0):
            kind = g[f"up{level}.refine"]
            y = b.block(f"refine{level}.{i}", y, "dense" if kind == "dense" else "tr", b.channels[y], 1 if kind == "dense" else int(kind[2]))
    b.block("head", y, "head", g["up0.channels"])
    return b


def alone(signature):
    """Returns the block of a signature as a complete network."""
    kind, inputs, outputs, expansion, stride, height, width = signature
    b = Blocks(inputs, height, width)
    b.block("block", "photo", kind, outputs, expansion, stride)
    return b


def all_signatures():
    """Returns the signatures of all blocks in the space. A block depends on only a few genes, so this function varies the genes of one
    block at a time, in all combinations."""
    found = {}

    def add(**changes):
        for signature in built(tuple(changes.get(n.replace(".", "_"), v) for n, v in zip(NAMES, SHIPPED))).signatures:
            found[signature] = True

    def vary(*genes):
        def fill(chosen, rest):
            if not rest:
                return add(**chosen)
            for choice in GENES[rest[0]]:
                fill({**chosen, rest[0].replace(".", "_"): choice}, rest[1:])
        fill({}, genes)
    vary("stem", "first")
    for i in range(len(DOWN)):
        before = "first" if i == 0 else f"down{i - 1}.channels"
        vary(before, f"down{i}.channels", f"down{i}.expansion", f"down{i}.kernel")
    for level in range(LEVELS):
        down = ("up0.channels", "first", "down0.channels", "down1.channels", "down3.channels", "down4.channels")[level]
        vary(f"up{level}.channels", *([f"up{level + 1}.channels"] if level < 5 else []), down) if level else vary("up0.channels", "up1.channels")
        if level:
            vary(f"up{level}.channels", f"up{level}.refine")
    return list(found)


def rows_of(blocks):
    """Formats operators for latency.cpp: kind, first input, second input, kernel, stride or factor, outputs."""
    number = {"photo": 0, **{op.name: i + 1 for i, op in enumerate(blocks.operators)}}
    rows = []
    for op in blocks.operators:
        if isinstance(op, Convolution):
            rows.append((int(op.depthwise), number[op.input], 0, op.kernel, op.stride, op.outputs))
        elif isinstance(op, Addition):
            rows.append((2, number[op.a], number[op.b], 0, 1, 0))
        else:
            rows.append((3, number[op.input], 0, 0, 2, 0))
    return rows


if __name__ == "__main__":
    print(f"{size():.1e} members, {len(all_signatures())} different blocks")
