"""Trains the network on a pool of drawn pictures; goes on from its checkpoint when there is one.

    python3 train.py POOL CHECKPOINT STEPS

Deterministic for one pool and one machine. The learning rate falls to nothing at STEPS; the first part runs at half the
size, where most is learnt. The weights to use are the running average.
"""

import glob
import math
import os
import sys
import time

import cv2
import numpy as np
import torch
import torch.nn.functional as F

from network import InstrumentNet

BATCH = 8
RATE = 3e-3
SMALL_UNTIL = 0.8  # of the steps
SMALL, LARGE = (192, 128), (320, 192)  # width, height
AVERAGE_DECAY = 0.995


class Pool:
    """The files drawn so far; it may grow meanwhile."""

    def __init__(self, folder):
        self.folder, self.files, self.looked = folder, {}, 0.0

    def sample(self, rng):
        if time.time() - self.looked > 20:
            self.looked = time.time()
            for name in sorted(glob.glob(os.path.join(self.folder, "pool_*[0-9].npy"))):
                if name not in self.files:
                    self.files[name] = np.load(name, mmap_mode="r")
        drawn = self.files[list(self.files)[rng.integers(len(self.files))]]
        return drawn[rng.integers(len(drawn))]


def example(rng, pool, size):
    """RGB 0..1 and mask 0..1 of `size`: cut out, mirrored, with another exposure and white balance."""
    drawn = pool.sample(rng)
    rows, columns = drawn.shape[:2]
    high = rng.integers(int(0.65 * rows), rows + 1)
    wide = min(columns, int(high * rng.uniform(1.1, 1.8)))
    top, left = rng.integers(0, rows - high + 1), rng.integers(0, columns - wide + 1)
    part = cv2.resize(np.ascontiguousarray(drawn[top : top + high, left : left + wide]), size,
                      interpolation=cv2.INTER_AREA if high > size[1] else cv2.INTER_LINEAR)
    if rng.random() < 0.5:
        part = part[:, ::-1]
    if rng.random() < 0.3:
        part = part[::-1]
    rgb, mask = part[..., 2::-1].astype(np.float32) / 255, part[..., 3].astype(np.float32) / 255
    if rng.random() < 0.7:
        rgb = np.clip(rgb * rng.uniform(0.95, 1.06, 3).astype(np.float32), 0, 1) ** np.float32(rng.uniform(0.8, 1.25))
    if rng.random() < 0.15:
        rgb = np.clip(rgb + rng.normal(0, 0.02, rgb.shape).astype(np.float32), 0, 1)
    return rgb, mask


def loss_of(logits, mask):
    probability = torch.sigmoid(logits)
    overlap = (probability * mask).sum((1, 2, 3))
    dice = 1 - (2 * overlap + 20) / (probability.sum((1, 2, 3)) + mask.sum((1, 2, 3)) + 20)
    return F.binary_cross_entropy_with_logits(logits, mask) + dice.mean()


def main(folder, checkpoint, steps):
    steps = int(steps)
    torch.set_num_threads(1)
    cv2.setNumThreads(1)
    torch.manual_seed(0)
    network = InstrumentNet().to(memory_format=torch.channels_last)
    trained = [p for p in network.parameters() if p.requires_grad]
    optimizer = torch.optim.AdamW(trained, lr=RATE, weight_decay=1e-4)
    step, average = 0, {k: v.clone() for k, v in network.state_dict().items()}
    if os.path.exists(checkpoint):
        saved = torch.load(checkpoint)
        network.load_state_dict(saved["network"])
        optimizer.load_state_dict(saved["optimizer"])
        average, step = saved["average"], saved["step"]
    pool, overlaps, begin = Pool(folder), [], time.time()
    while step < steps:
        rng = np.random.default_rng(step)
        size = SMALL if step < SMALL_UNTIL * steps else LARGE
        rate = RATE * min(1, (step + 1) / 50) * (0.5 + 0.5 * math.cos(math.pi * step / steps)) + 1e-5
        for group in optimizer.param_groups:
            group["lr"] = rate
        batch = [example(rng, pool, size) for _ in range(BATCH)]
        rgb = torch.from_numpy(np.stack([i for i, _ in batch])).permute(0, 3, 1, 2).contiguous(memory_format=torch.channels_last)
        mask = torch.from_numpy(np.stack([m for _, m in batch]))[:, None]
        logits = network(rgb)
        loss = loss_of(logits, mask)
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(trained, 2.0)
        optimizer.step()
        step += 1
        decay = min(AVERAGE_DECAY, step / (step + 10))
        with torch.no_grad():
            for name, value in network.state_dict().items():
                if value.dtype.is_floating_point:
                    average[name].mul_(decay).add_(value, alpha=1 - decay)
                else:
                    average[name].copy_(value)
            found, true = logits > 0, mask > 0.5
            overlaps.append(((found & true).sum() / max(1, (found | true).sum())).item())
        if step % 50 == 0 or step == steps:
            print(f"step {step} of {steps}, {time.time() - begin:.0f} s, rate {rate:.5f}, loss {loss.item():.3f}, "
                  f"IoU {np.mean(overlaps[-50:]):.3f}, {len(pool.files)} files", flush=True)
            state = {"network": network.state_dict(), "optimizer": optimizer.state_dict(), "average": average, "step": step}
            torch.save(state, checkpoint + ".part")
            os.replace(checkpoint + ".part", checkpoint)


if __name__ == "__main__":
    main(*sys.argv[1:4])
