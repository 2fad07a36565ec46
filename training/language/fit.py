"""Fit the network to a pool of examples."""

import random
import time
from math import cos, pi

import numpy as np
import torch
from training.language.network import Network, Size
from training.language.pool import Pool, batches, collated

from avlmaps.language.learned.features import columns

_PEAK, _GENTLE, _WARM, _BATCH = 2.5e-3, 1e-3, 0.04, 64
_UNKNOWN, _NO_MEANING = 0.12, 0.04  # how often a word loses its number, and its vector too


def fitted(
    pool: Pool, vocabulary: dict[str, int], minutes: float, seed: int, *, start: Network | None = None, note: str = ""
) -> Network:
    """Return a network fitted for some minutes of the processor; the average of its last weights.

    Args:
        pool: examples.
        vocabulary: words with a number of their own.
        minutes: processor time.
        seed: of weights and order.
        start: a network to continue from, more gently.
        note: printed with the progress.
    """
    peak = _PEAK if start is None else _GENTLE
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    draw = random.Random(seed)
    noise = np.random.default_rng(seed)
    network = (Network(Size(len(vocabulary))) if start is None else start).train()
    mean = torch.optim.swa_utils.AveragedModel(network, multi_avg_fn=torch.optim.swa_utils.get_ema_multi_avg_fn(0.998))
    optimiser = torch.optim.AdamW(network.parameters(), lr=peak, weight_decay=0.02, betas=(0.9, 0.98))
    to_known = np.array([vocabulary.get(word, 0) for word in pool.words], np.int64)
    began, step, total = time.process_time(), 0, 0.0
    for items in batches(pool, _BATCH, draw):
        done = (time.process_time() - began) / (60.0 * minutes)
        if done >= 1.0:
            break
        rate = peak * (min(1.0, step / 100) if done < _WARM else 0.5 * (1 + cos(pi * (done - _WARM) / (1 - _WARM))))
        for group in optimiser.param_groups:
            group["lr"] = rate + 1e-5
        arrays = collated(items, pool, to_known, len(columns()))
        lost = noise.random(arrays["words"].shape)
        arrays["words"][lost < _UNKNOWN] = 0
        arrays["meaning"][lost < _NO_MEANING] = 0.0
        arrays["context"][noise.random(lost.shape) < _NO_MEANING] = 0.0
        batch = {name: torch.from_numpy(array) for name, array in arrays.items()}
        loss = network.loss(batch)
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        mean.update_parameters(network)
        step, total = step + 1, total + float(loss.detach())
        if step % 200 == 0:
            print(f"{note} step {step}, {done:.0%}, loss {total / 200:.4f}", flush=True)
            total = 0.0
    best = mean.module
    assert isinstance(best, Network)
    return best.eval()
