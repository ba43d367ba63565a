"""The Muon optimizer: momentum with orthogonalized updates, for the weights of matrices and convolutions (K. Jordan and others, "Muon: An
optimizer for hidden layers in neural networks", 2024). Adam updates the other weights. Muon's step length matches Adam's (J. Liu and
others, "Muon is Scalable for LLM Training", 2025), so that both use the same learning rate.
"""
import math

import torch

COEFFICIENTS = (3.4445, -4.7750, 2.0315)  # coefficients of the fifth-degree polynomial that moves singular values toward 1
ITERATIONS = 5
STEP_LENGTH = 0.2  # root mean square of a step's elements at learning rate 1, equal to Adam's


def orthogonalized(matrix, dtype):
    """Approximates U V^T for the matrix U S V^T."""
    a, b, c = COEFFICIENTS
    x = (matrix / (matrix.norm() + 1e-7)).to(dtype)
    x = x.T if x.shape[0] > x.shape[1] else x
    for _ in range(ITERATIONS):
        gram = x @ x.T
        x = a * x + (b * gram + c * gram @ gram) @ x
    return (x.T if matrix.shape[0] > matrix.shape[1] else x).to(matrix.dtype)


class Muon(torch.optim.Optimizer):
    def __init__(self, parameters, lr, momentum=0.95, decay=0.2, betas=(0.9, 0.99), eps=1e-8, dtype=torch.bfloat16):
        """
        decay  weight decay of the matrices, times the learning rate per step. Steps of fixed length make weights grow. The size of weights
               before a normalization has no effect on the result, but a step changes the direction of larger weights less. Decay
               limits their size.
        dtype  data type of the matrix products
        """
        super().__init__(parameters, {"lr": lr, "momentum": momentum, "decay": decay, "betas": betas, "eps": eps})
        self.dtype = dtype

    @torch.no_grad()
    def step(self):
        for group in self.param_groups:
            for p in group["params"]:
                if p.grad is not None:
                    (self.orthogonal_step if p.dim() > 1 else self.adam_step)(p, group)

    def orthogonal_step(self, p, group):
        state = self.state[p]
        if not state:
            state["momentum"] = torch.zeros_like(p)
        state["momentum"].mul_(group["momentum"]).add_(p.grad)
        direction = p.grad.add(state["momentum"], alpha=group["momentum"]).flatten(1)
        length = group["lr"] * STEP_LENGTH * math.sqrt(max(direction.shape))
        p.mul_(1 - group["lr"] * group["decay"])
        p.add_(orthogonalized(direction, self.dtype).view_as(p), alpha=-length)

    def adam_step(self, p, group):
        state, (first, second) = self.state[p], group["betas"]
        if not state:
            state["steps"], state["mean"], state["square"] = 0, torch.zeros_like(p), torch.zeros_like(p)
        state["steps"] += 1
        state["mean"].lerp_(p.grad, 1 - first)
        state["square"].mul_(second).addcmul_(p.grad, p.grad, value=1 - second)
        spread = (state["square"] / (1 - second ** state["steps"])).sqrt_().add_(group["eps"])
        p.addcdiv_(state["mean"], spread, value=-group["lr"] / (1 - first ** state["steps"]))
