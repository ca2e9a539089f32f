"""The training loop: AdamW with a cosine schedule, averaged weights, checkpoints."""

import copy
import math
import time

import numpy as np
import torch
from torch.utils.data import DataLoader

from .data import Looks, Pictures, as_input, batch_of
from .heads import cells, flat
from .losses import losses
from .network import Network
from .progress import Progress
from .settings import CLASSES


def optimiser_of(network, rate, decay):
    """Applies weight decay only to the weights of convolutions."""
    weights = [p for p in network.parameters() if p.ndim > 1]
    others = [p for p in network.parameters() if p.ndim <= 1]
    groups = [{"params": weights, "weight_decay": decay}, {"params": others, "weight_decay": 0.0}]
    return torch.optim.AdamW(groups, lr=rate)


@torch.no_grad()
def average(slow, fast, step):
    """Exponential average with a faster start. Includes buffers (batch norm's statistics)."""
    keep = min(0.9985, (1 + step) / (20 + step))
    for a, b in zip(slow.state_dict().values(), fast.state_dict().values()):
        if a.dtype.is_floating_point:
            a.lerp_(b.to(a.dtype), 1 - keep)
        else:
            a.copy_(b)


@torch.no_grad()
def settle_statistics(network, pictures, batches=100, batch=32, seed=1):
    """Recomputes the batch-norm statistics in float32 as the mean over unchanged pictures of all
    scenes (Wu and Johnson, "Rethinking 'Batch' in BatchNorm", 2021). The statistics from training
    come from augmented pictures in bf16."""
    norms = [m for m in network.modules() if isinstance(m, torch.nn.BatchNorm2d)]
    momenta = [m.momentum for m in norms]
    for m in norms:
        m.reset_running_stats()
        m.momentum = None  # average over all batches
    network.train()
    rng = np.random.default_rng(seed)
    for _ in range(batches):
        chosen = rng.choice(len(pictures), batch, replace=False)
        images, _ = batch_of([pictures[(0, int(i))] for i in chosen])
        network(as_input(images).contiguous(memory_format=torch.channels_last))
    network.eval()
    for m, momentum in zip(norms, momenta):
        m.momentum = momentum


class Trainer:
    def __init__(self, options, folders):
        self.options = options
        torch.manual_seed(options.seed)
        torch.set_num_threads(options.threads)
        self.network = Network().to(memory_format=torch.channels_last)
        self.slow = copy.deepcopy(self.network).eval()
        self.optimiser = optimiser_of(self.network, options.rate, options.decay)
        self.step, self.share = 0, 0.0
        favour = CLASSES.index(options.favour) if options.favour else None
        self.pictures = Pictures(folders, True, options.seed, favour, options.crops)
        self.centres, self.strides = cells()
        self.checkpoint = options.cache / options.name / "checkpoint.pt"

    def resume(self):
        if not self.checkpoint.exists():
            return False
        state = torch.load(self.checkpoint, map_location="cpu")
        self.network.load_state_dict(state["network"])
        self.slow.load_state_dict(state["slow"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.step, self.share = state["step"], state["share"]
        return True

    def save(self):
        state = {name: getattr(self, name).state_dict() for name in ("network", "slow", "optimiser")}
        state.update(step=self.step, share=self.share)
        self.checkpoint.parent.mkdir(parents=True, exist_ok=True)
        part = self.checkpoint.with_suffix(".part")
        torch.save(state, part)
        part.replace(self.checkpoint)  # replaces the file atomically

    def rate(self):
        """Factor of the learning rate: a warm-up, then a cosine of the completed share."""
        warm = min(1.0, (self.step + 1) / 150)
        return self.options.rate * warm * (0.01 + 0.99 * 0.5 * (1 + math.cos(math.pi * self.share)))

    def batches(self):
        looks = Looks(len(self.pictures), self.options.batch, self.step * self.options.batch,
                      self.options.seed)
        return DataLoader(self.pictures, batch_sampler=looks, num_workers=self.options.workers,
                          collate_fn=batch_of, prefetch_factor=4 if self.options.workers else 2)

    def one_step(self, images, truth):
        for group in self.optimiser.param_groups:
            group["lr"] = self.rate()
        images = as_input(images).contiguous(memory_format=torch.channels_last)
        with torch.autocast("cpu", dtype=torch.bfloat16, enabled=self.options.bf16):
            outputs = self.network(images)
        terms = losses(flat(outputs), truth, self.centres, self.strides)
        self.optimiser.zero_grad(set_to_none=True)
        sum(terms.values()).backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 10.0)
        self.optimiser.step()
        self.step += 1
        average(self.slow, self.network, self.step)
        return {name: float(value.detach()) for name, value in terms.items()}

    def run(self):
        """Trains until all steps are done or the given minutes have passed."""
        options, smooth = self.options, {}
        progress = Progress("training")
        started, before, saved = time.time(), self.share, time.time()
        if self.share >= 1.0:
            return
        for images, truth in self.batches():
            terms = self.one_step(images, truth)
            smooth = {k: 0.98 * smooth.get(k, v) + 0.02 * v for k, v in terms.items()}
            if options.minutes:
                self.share = before + (time.time() - started) / (60 * options.minutes) * (1 - before)
            else:
                self.share = self.step / options.steps
            text = " ".join(f"{k} {v:.3f}" for k, v in smooth.items())
            progress.show(self.share, f"step {self.step} {text}")
            if time.time() - saved > 60 or self.share >= 1.0:
                self.save()
                saved = time.time()
            if self.share >= 1.0:
                return
