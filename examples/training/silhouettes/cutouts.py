"""Finds masks of whole objects in photographs, which composites.py pastes over other photographs.

    python3 cutouts.py --photos PHOTOS --masks MASKS --out FOLDER

MASKS is a folder with masks.py, u2netp.param and u2netp.bin (U2Netp, Apache-2.0). Writes NAME.png, 8 bits, for every photograph with a
confident mask. Lists finished photographs in FOLDER/seen.txt, and skips the photographs that the file already lists.
"""
import argparse
import glob
import os
import sys

import cv2
import numpy as np
import torch

SIDE = 320  # input size of U2Netp
MIN_SHARE, MAX_SHARE = 0.04, 0.8  # range of the object's share of the photograph
MAX_DOUBT = 0.2  # maximum number of doubtful pixels (50 to 205 of 255), relative to the object's pixels
MEAN, SPREAD = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)  # mean and standard deviation of the colors in U2Netp's training, per channel


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--photos", required=True)
    p.add_argument("--masks", required=True)
    p.add_argument("--out", required=True)
    a = p.parse_args()
    torch.set_num_threads(1)
    cv2.setNumThreads(1)
    sys.dont_write_bytecode = True
    sys.path.append(a.masks)
    import masks
    net = masks.load(os.path.join(a.masks, "u2netp.param"), os.path.join(a.masks, "u2netp.bin"))
    os.makedirs(a.out, exist_ok=True)
    with open(os.path.join(a.out, "seen.txt"), "a+") as log:
        log.seek(0)
        seen = set(log.read().split())
        names = [n for n in sorted(os.listdir(a.photos)) if n not in seen]
        np.random.default_rng(1).shuffle(names)
        for name in names:
            photo = cv2.imread(os.path.join(a.photos, name), cv2.IMREAD_COLOR)[:, :, ::-1]
            x = cv2.resize(photo, (SIDE, SIDE), interpolation=cv2.INTER_AREA).astype(np.float32)
            x = (x / max(x.max(), 1) - MEAN) / SPREAD
            with torch.no_grad():
                blobs = masks.run(net, torch.tensor(x, dtype=torch.float32).permute(2, 0, 1)[None])
            last = "out0" if "out0" in blobs else next(o[0] for kind, _, o, _, _ in net if kind == "Sigmoid")
            mask = cv2.resize(np.uint8(255 * blobs[last][0, 0].numpy().clip(0, 1)), photo.shape[1::-1], interpolation=cv2.INTER_CUBIC)
            inside = (mask > 128).sum()
            doubt = ((mask > 50) & (mask < 205)).sum() / max(1, inside)
            if MIN_SHARE < inside / mask.size < MAX_SHARE and doubt < MAX_DOUBT:
                cv2.imwrite(os.path.join(a.out, os.path.splitext(name)[0] + ".png"), mask)
            print(name, file=log, flush=True)
    print(f"{len(glob.glob(os.path.join(a.out, '*.png')))} masks in {a.out}")


if __name__ == "__main__":
    main()
