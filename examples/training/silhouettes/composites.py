"""Composites with known silhouettes: shapes and objects from photographs, pasted over other photographs with exact alpha. Computes the true
disparity of the two or three sheets, and degrades it with the typical errors of depth networks."""
import math
import os

import cv2
import numpy as np

SUPER = 4  # supersampling factor of shapes
CUTOUT_SHARE = 0.45
HELD_OUT = 24
KINDS = ("polygon", "ellipse", "blob", "hair", "leaves", "bars", "fence", "letters", "branches")
FINE = ("hair", "leaves", "fence", "letters", "branches")


def noise(rng, size, scale):
    """Returns smooth noise of about unit variance; `scale` in pixels."""
    h, w = size
    small = rng.standard_normal((max(2, int(h / scale) + 2), max(2, int(w / scale) + 2))).astype(np.float32)
    return cv2.resize(small, (w, h), interpolation=cv2.INTER_CUBIC)


def strokes(rng, mask, roots, directions, length, thick):
    """Draws curved, tapering strokes that start at `roots`."""
    for root, angle in zip(roots, directions):
        t = np.linspace(0, 1, 9)[:, None]
        along, aside = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        reach = length * rng.uniform(0.4, 1)
        path = np.int32(root + reach * t * along + reach * t * t * rng.uniform(-0.5, 0.5) * aside)
        width = max(1, int(rng.integers(1, thick + 1)))
        cv2.polylines(mask, [path], False, 255, width)
        if width > 2:
            cv2.polylines(mask, [path[:5]], False, 255, width + 2)


def shape(rng, size):
    """Returns (mask of a random shape, 0 or 255, at SUPER times the size; kind)."""
    h, w = (s * SUPER for s in size)
    n, m = min(h, w), np.zeros((h, w), np.uint8)
    kind = str(rng.choice(KINDS))

    def point(a=0.15, b=0.85):
        return np.array([rng.uniform(a, b) * w, rng.uniform(a, b) * h])

    def ellipse(center, radius, flat):
        cv2.ellipse(m, tuple(int(v) for v in center), (int(radius), int(radius * flat)), rng.uniform(0, 180), 0, 360, 255, -1)

    if kind == "polygon":
        for _ in range(rng.integers(1, 4)):
            k, center, radius = rng.integers(3, 9), point(), rng.uniform(0.08, 0.45) * n
            a, q = np.sort(rng.uniform(0, 2 * np.pi, k)), radius * rng.uniform(0.4, 1.2, k)
            cv2.fillPoly(m, [np.int32(center + np.stack([np.cos(a), np.sin(a)], 1) * q[:, None])], 255)
    elif kind == "ellipse":
        for _ in range(rng.integers(1, 5)):
            ellipse(point(), rng.uniform(0.05, 0.4) * n, rng.uniform(0.25, 1))
    elif kind == "blob":
        scale = rng.uniform(12, 90) * SUPER
        f = noise(rng, (h // 4, w // 4), scale / 4) + 0.4 * rng.random() * noise(rng, (h // 4, w // 4), scale / 12)
        m[:] = cv2.resize(np.where(cv2.resize(f, (w, h), interpolation=cv2.INTER_LINEAR) > rng.uniform(-0.2, 0.6), 255, 0).astype(np.uint8), (w, h))
    elif kind == "hair":
        for _ in range(rng.integers(1, 4)):
            center, radius, lean = point(), rng.uniform(0.1, 0.35) * n, rng.uniform(0, 2 * np.pi)
            ellipse(center, radius, rng.uniform(0.6, 1))
            a = rng.uniform(0, 2 * np.pi, rng.integers(40, 400))
            roots = center + 0.75 * radius * np.stack([np.cos(a), np.sin(a)], 1)
            strokes(rng, m, roots, 0.7 * a + 0.3 * lean + rng.uniform(-0.35, 0.35, len(a)), radius * rng.uniform(0.3, 1), int(rng.integers(2, 8)))
    elif kind == "branches":
        for _ in range(rng.integers(2, 9)):
            root, angle, reach, thick = point(-0.1, 1.1), rng.uniform(0, 2 * np.pi), rng.uniform(0.2, 0.8) * n, rng.uniform(4, 40)
            t = np.linspace(0, 1, 12)[:, None]
            path = root + reach * t * [np.cos(angle), np.sin(angle)] + 0.1 * reach * np.cumsum(rng.normal(0, 0.4, (12, 2)), 0)
            for i in range(11):
                cv2.line(m, tuple(np.int32(path[i]).tolist()), tuple(np.int32(path[i + 1]).tolist()), 255, max(2, int(thick * (1 - i / 12))))
            strokes(rng, m, path[rng.integers(2, 12, 12)], angle + rng.choice([-1, 1], 12) * rng.uniform(0.4, 1.2, 12), 0.4 * reach, 8)
    elif kind == "leaves":
        for _ in range(rng.integers(6, 60)):
            c, a, length, flat = point(0, 1), rng.uniform(0, 2 * np.pi), rng.uniform(0.03, 0.2) * n, rng.uniform(0.15, 0.45)
            t = np.linspace(0, np.pi, 12)
            x, y = -np.cos(t) * length, np.sin(t) * length * flat
            q = np.concatenate([np.stack([x, y], 1), np.stack([x, -y], 1)[::-1]]) @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]])
            cv2.fillPoly(m, [np.int32(c + q)], 255)
    elif kind == "bars":
        for _ in range(rng.integers(1, 5)):
            cv2.line(m, tuple(np.int32(point(-0.2, 1.2)).tolist()), tuple(np.int32(point(-0.2, 1.2)).tolist()), 255, int(rng.uniform(12, 200)))
    elif kind == "fence":
        gap, thick, across = rng.uniform(0.05, 0.2) * n, rng.uniform(0.12, 0.5), rng.random() < 0.6
        y, x = np.mgrid[0:h:2, 0:w:2].astype(np.float32)
        a = rng.uniform(-0.4, 0.4)
        u, v = x * np.cos(a) + y * np.sin(a), y * np.cos(a) - x * np.sin(a)
        f = (u % gap < thick * gap) | (across & (v % (gap * rng.uniform(1, 4)) < thick * gap * rng.uniform(0.5, 1)))
        m[:] = cv2.resize(np.uint8(f) * 255, (w, h), interpolation=cv2.INTER_NEAREST)
    else:
        for _ in range(rng.integers(1, 5)):
            text = "".join(rng.choice(list("ABCDEFGHKMNOPRSTUVWXYZabdeghkmnrstuvy023456789&"), rng.integers(1, 6)))
            size_of, thick = rng.uniform(0.008, 0.04) * n, int(rng.uniform(6, 60))
            cv2.putText(m, text, tuple(np.int32(point(-0.1, 0.7)).tolist()), int(rng.choice([0, 2, 3, 4, 6, 7])), size_of, 255, thick)
    if kind in ("polygon", "ellipse", "blob", "leaves") and rng.random() < 0.2:  # holes
        holes = np.zeros_like(m)
        for _ in range(rng.integers(2, 25)):
            cv2.circle(holes, tuple(np.int32(point(0, 1)).tolist()), int(rng.uniform(0.01, 0.08) * n), 255, -1)
        m &= ~holes
    return m, kind


class Composites:
    """Makes composites from a folder's photographs and masks of objects in them."""

    def __init__(self, photos, masks, seed, part=None):
        """part: "held out" uses one in HELD_OUT photographs, "train" all others"""
        self.rng = np.random.default_rng(seed)
        names = sorted(os.listdir(photos))
        if part is not None:
            names = [n for i, n in enumerate(names) if (i % HELD_OUT == 0) == (part == "held out")]
        self.photos = [cv2.cvtColor(cv2.imread(os.path.join(photos, n), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB) for n in names]
        self.masks_folder, self.index = masks, {os.path.splitext(n)[0]: i for i, n in enumerate(names)}
        self.find_cutouts()

    def find_cutouts(self):
        found = [os.path.splitext(n)[0] for n in sorted(os.listdir(self.masks_folder)) if n.endswith(".png")]
        self.cutouts = [n for n in found if n in self.index]

    def texture(self, size, which=None):
        """Returns (a scaled, sometimes mirrored crop of a photograph, the photograph's index)."""
        rng, (h, w) = self.rng, size
        i = int(rng.integers(len(self.photos))) if which is None else which
        p = self.photos[i]
        scale = max(rng.uniform(0.7, 1.5), (h + 2) / p.shape[0], (w + 2) / p.shape[1])
        y, x = rng.uniform(0, p.shape[0] - h / scale), rng.uniform(0, p.shape[1] - w / scale)
        a = np.float32([[scale, 0, -x * scale], [0, scale, -y * scale]])
        t = cv2.warpAffine(p, a, (w, h), flags=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
        return (t[:, ::-1] if rng.random() < 0.5 else t).astype(np.float32), i

    def cutout(self, size):
        """Returns a random object, randomly placed, as (colors, mask at SUPER times the size). None if the mask has almost no object."""
        rng, (h, w) = self.rng, size
        name = self.cutouts[int(rng.integers(len(self.cutouts)))]
        p, mask = self.photos[self.index[name]], cv2.imread(os.path.join(self.masks_folder, name + ".png"), cv2.IMREAD_GRAYSCALE)
        mask = cv2.erode(mask, np.ones((5, 5), np.uint8))  # removes the rim, which may show the old background
        ys, xs = np.nonzero(mask > 128)
        if len(ys) < 400:
            return None
        center = np.array([xs.mean(), ys.mean()])
        extent = max(np.ptp(xs), np.ptp(ys))
        s = np.clip(rng.uniform(0.3, 1.1) * min(h, w) / extent, 0.4, 1.7)
        g, flip = rng.normal(0, 0.2), rng.choice([-1, 1])
        a = s * np.array([[np.cos(g) * flip, -np.sin(g)], [np.sin(g) * flip, np.cos(g)]])
        m = np.float32(np.c_[a, np.array([rng.uniform(0.15, 0.85) * w, rng.uniform(0.25, 0.95) * h]) - a @ center])
        colors = cv2.warpAffine(p, m, (w, h), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT).astype(np.float32)
        big = cv2.warpAffine(cv2.GaussianBlur(mask, (0, 0), 1), m * SUPER, (w * SUPER, h * SUPER), flags=cv2.INTER_LINEAR)
        return colors, (big > 128).astype(np.uint8) * 255

    def front(self, size, back_index):
        """Returns (colors, alpha, kind) of an object to paste."""
        rng = self.rng
        while True:
            cut, same = None, rng.random() < 0.2
            if self.cutouts and rng.random() < CUTOUT_SHARE:
                cut = self.cutout(size)
            if cut is not None:
                colors, big, kind = *cut, "cutout"
            else:
                big, kind = shape(rng, size)
                colors, _ = self.texture(size, back_index if same else None)
            alpha = cv2.resize(big, size[::-1], interpolation=cv2.INTER_AREA).astype(np.float32) / 255
            if 0.01 < alpha.mean() < 0.85:
                return colors, alpha, kind

    def composite(self, size):
        """Returns (photo H x W x 3 uint8; weights of the sheets S x H x W, farthest first, with sum 1; kinds of the pasted objects, joined
        by +)."""
        rng = self.rng
        image, index = self.texture(size)
        if rng.random() < 0.3:
            image = cv2.GaussianBlur(image, (0, 0), rng.uniform(0.7, 4))
        if rng.random() < 0.3:
            image = image * rng.uniform(0.4, 1.2)
        sheets, kinds = [np.ones(size, np.float32)], []
        for _ in range(2 if rng.random() < 0.5 else 1):
            colors, alpha, kind = self.front(size, index)
            if rng.random() < 0.35:  # similar colors, or dark on dark
                near = cv2.dilate((alpha > 0.5).astype(np.uint8), np.ones((15, 15), np.uint8)) > 0
                if near.any():
                    colors = colors + (image[near].mean(0) - colors[near].mean(0)) * rng.uniform(0.4, 1)
            if rng.random() < 0.25:
                g = rng.uniform(0.3, 1.1)
                colors = colors * g
                if rng.random() < 0.6:
                    image = image * g * rng.uniform(0.8, 1.1)
            if rng.random() < 0.15:  # soft shadow on the surface behind
                image = image * (1 - 0.6 * rng.random() * cv2.GaussianBlur(alpha, (0, 0), rng.uniform(3, 12)))[..., None]
            image = np.clip(colors, 0, 255) * alpha[..., None] + np.clip(image, 0, 255) * (1 - alpha[..., None])
            sheets = [s * (1 - alpha) for s in sheets] + [alpha]
            kinds.append(kind)
        soft = rng.uniform(0, 1)
        if soft > 0.3:
            image = cv2.GaussianBlur(image, (0, 0), soft)
        image = np.clip(image + rng.standard_normal(image.shape) * rng.uniform(0, 6), 0, 255).astype(np.uint8)
        if rng.random() < 0.5:
            image = cv2.imdecode(cv2.imencode(".jpg", image, [1, int(rng.uniform(60, 97))])[1], 1)
        return image, np.stack(sheets), "+".join(kinds)

    def disparity(self, weights, min_step=0.12, fading=0.0):
        """Returns a true disparity for opaque sheets. Each sheet is a gentle slope, sometimes with a smaller step inside.

        min_step  minimum step between neighboring sheets
        fading    share of the pasted sheets that slope down to the sheet behind in one direction, like objects on the ground
        """
        rng, size = self.rng, weights.shape[1:]
        y, x = np.mgrid[-0.5:0.5:size[0] * 1j, -0.5:0.5:size[1] * 1j].astype(np.float32)
        base, true = rng.uniform(0.02, 0.25), None
        owner = weights.argmax(0)
        for k in range(len(weights)):
            step = 0.0 if k == 0 else math.exp(rng.uniform(math.log(min_step), math.log(0.6 / (len(weights) - 1))))
            base += step
            tilt = 0.15 if k == 0 else 0.4 * step
            sheet = base + (y * rng.uniform(-1, 1) + x * rng.uniform(-1, 1)) * tilt + noise(rng, size, 60) * max(step, 0.1) * 0.04
            if rng.random() < 0.15:
                small, _ = shape(rng, (size[0] // SUPER, size[1] // SUPER))
                sheet = sheet - (cv2.resize(small, size[::-1], interpolation=cv2.INTER_AREA) > 128) * max(step, 0.1) * rng.uniform(0.1, 0.35)
            if k > 0 and fading and rng.random() < fading:
                angle, rows, columns = rng.uniform(0, 2 * np.pi), *np.nonzero(owner == k)
                if len(rows):
                    along = y * np.sin(angle) + x * np.cos(angle)
                    low, high = np.percentile(along[rows, columns], [0, 100])
                    start, width = rng.uniform(low, 0.6 * high + 0.4 * low), rng.uniform(0.05, 0.5)
                    sheet = true + (sheet - true) * np.clip((along - start) / width, 0, 1)
            true = sheet if k == 0 else np.where(owner == k, sheet, true)
        return np.clip(true, 0, 1).astype(np.float32)

    def spoiled(self, true, level, least=1.15):
        """Returns a disparity map with fewer samples and a network's typical errors. level: strength of the errors, 0 to 1; least: minimum
        factor by which the map is shrunk."""
        rng, (h, w) = self.rng, true.shape
        d = true
        if rng.random() < 0.4:  # networks miss thin objects and fill thin holes
            k = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (int(rng.integers(1, 4)) * 2 + 1,) * 2)
            d = cv2.morphologyEx(d, cv2.MORPH_OPEN if rng.random() < 0.6 else cv2.MORPH_CLOSE, k)
        shrink = rng.uniform(least, 2 + 2 * level)
        angle, shift = rng.uniform(0, 2 * np.pi), rng.uniform(0, 3) * level * shrink
        wobble = np.float32(rng.uniform(0, 1.2) * level * shrink)
        y, x = np.mgrid[0:h, 0:w].astype(np.float32)
        d = cv2.remap(d, x + np.float32(shift * np.cos(angle)) + wobble * noise(rng, (h, w), 30),
                      y + np.float32(shift * np.sin(angle)) + wobble * noise(rng, (h, w), 30), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        size = (max(8, round(w / shrink)), max(8, round(h / shrink)))
        d = cv2.GaussianBlur(cv2.resize(d, size, interpolation=cv2.INTER_AREA), (0, 0), 0.7 + 2.3 * level * rng.uniform(0.5, 1))

        def patches():
            return np.clip(2 * noise(rng, size[::-1], 15) - 0.5, 0, 1)

        if level > 0.1 and rng.random() < 0.25:  # wide blur
            t = patches()
            d = d * (1 - t) + t * cv2.GaussianBlur(d, (0, 0), rng.uniform(2, 6))
        if level > 0.1 and rng.random() < 0.25:  # half-filled gaps
            t = patches() * rng.uniform(0.2, 0.7)
            k = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (int(rng.integers(2, 6)) * 2 + 1,) * 2)
            d = d * (1 - t) + t * cv2.GaussianBlur(cv2.dilate(d, k), (0, 0), 1.5)
        return (np.round(np.clip(d, 0, 1) * 255) / 255).astype(np.float32)


OUTSIDE, CONTEXT, LABELED, NO_STEP = 0, 1, 2, 3  # states: outside the region; no label; alpha known; curve is no true step


def labels(band, weights, all_steps_known, radius=10, min_excess=0.15):
    """Returns (alpha H x W, state H x W). alpha is each pixel's share of the front surface of its nearest curve.

    Each sheet has a share of the pixels on the front side and on the back side of a curve. The curve's front sheet is the one whose share
    of the front side most exceeds its share of the back side. The back sheet is found in the same way, with the sides exchanged. Sheets
    nearer than the front sheet count as front, and sheets farther than the back sheet count as back. Pixels of sheets between the two have
    no label.
    weights          S x H x W, share of each sheet in each pixel, farthest sheet first
    all_steps_known  whether the disparity has steps only between sheets
    radius           half the width of the windows in which shares are counted, in pixels
    min_excess       minimum difference between a sheet's two shares; pixels beside other curves have no label
    """
    state = np.where(band.region, CONTEXT, OUTSIDE).astype(np.uint8)
    alpha = np.zeros(state.shape, np.float32)
    if not band.curve.any():
        return alpha, state
    side = (band.share(band.prepared) > 0.5) & band.region
    box = (2 * radius + 1, 2 * radius + 1)

    def around(mask):
        return cv2.boxFilter(mask.astype(np.float32), -1, box, normalize=False, borderType=cv2.BORDER_CONSTANT).reshape(-1)[curve]

    curve = np.flatnonzero(band.curve)
    number = np.zeros(state.size, np.int32)
    number[curve] = np.arange(len(curve))
    owner = weights.argmax(0)
    fronts, backs = np.maximum(around(side), 1), np.maximum(around(band.region & ~side), 1)
    excess = np.stack([around((owner == k) & side) / fronts - around((owner == k) & band.region & ~side) / backs for k in range(len(weights))])
    front, back = excess.argmax(0), excess.argmin(0)
    good = (excess.max(0) > min_excess) & (excess.min(0) < -min_excess) & (front > back)
    at = number[band.at]
    front, back, good = front[at], back[at], good[at]
    between = np.zeros_like(alpha)
    for k in range(len(weights)):
        alpha += np.where(k >= front, weights[k], 0)
        between += np.where((k > back) & (k < front), weights[k], 0)
    state[band.band & good & (between <= 0.1)] = LABELED
    if all_steps_known:
        state[band.band & ~good] = NO_STEP
    return alpha, state
