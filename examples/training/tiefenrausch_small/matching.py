"""The teacher asked about the very crop that the student sees, in place of a label that its photograph got once: as many different examples
as there are crops, and a student that answers as the teacher does wherever it looks (Beyer et al., Knowledge distillation: a good teacher is
patient and consistent, CVPR 2022)."""
import sys

import cv2
import numpy as np
import torch

import labels

LAYOUT_SIDE, DETAIL_SIDE = 224, 384  # short sides at which the teacher sees a crop
AGREEMENT = 0.6  # correlation with the label of the photograph, below which the teacher isn't believed about a part of it


class Teacher:
    """folder: of teacher.py"""

    def __init__(self, folder):
        sys.path.append(folder)
        import teacher
        self.network = teacher.Teacher()
        weights = self.network.weights
        self.network.weights = {n: w.contiguous(memory_format=torch.channels_last) if w.dim() == 4 else w for n, w in weights.items()}

    @torch.no_grad()
    def at(self, photo, side, mirrored):
        """Disparity, of the size of the photo, as the network sees it at this short side."""
        height, width = (max(32, round(n * side / min(photo.shape[:2]) / 32) * 32) for n in photo.shape[:2])
        seen = cv2.resize(photo, (width, height), interpolation=cv2.INTER_AREA if height < photo.shape[0] else cv2.INTER_LINEAR)
        colour = torch.from_numpy(np.ascontiguousarray(seen[:, ::-1] if mirrored else seen)).permute(2, 0, 1)[None].float() / 255
        disparity = self.network(colour.contiguous(memory_format=torch.channels_last))[0, 0].numpy()
        disparity = disparity[:, ::-1] if mirrored else disparity
        return cv2.resize(np.ascontiguousarray(disparity), photo.shape[1::-1], interpolation=cv2.INTER_LINEAR)

    def asked(self, rng, photo):
        """What it says of a photo (H x W x 3 uint8, any part of a photograph or mixture of two): disparity H x W, standardised, steps on
        colour edges."""
        mirrored = rng.random() < 0.5
        layout = labels.standardised(self.at(photo, LAYOUT_SIDE, mirrored))
        detail = labels.fitted(self.at(photo, DETAIL_SIDE, not mirrored), layout)
        sigma = labels.COARSE_SIGMA * max(photo.shape[:2]) / 384
        return labels.snapped(detail + cv2.GaussianBlur(layout - detail, (0, 0), sigma), photo, 1)

    def label(self, rng, photo, known):
        """A label for a part of a photograph.

        known  H x W, the part of that photograph's label: it says how deep this part is, and is the label itself where the teacher
               disagrees with it"""
        disparity = self.asked(rng, photo)
        if np.corrcoef(disparity.ravel(), known.ravel())[0, 1] > AGREEMENT:
            return np.clip(labels.fitted(disparity, known), 0, 1.25)
        return known
