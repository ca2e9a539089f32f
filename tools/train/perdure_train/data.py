"""Reads pictures with ground truth from a cache folder through memory maps, and forms batches."""

import json
from pathlib import Path

import numpy as np
import torch
from torch.utils.data import Dataset

from .augment import augmented

FIELDS = {"boxes": np.float32, "classes": np.int64, "azimuths": np.float32, "ignored": bool}


class Chunk:
    """One simulated scene: images.npy (N, 240, 320, 3) uint8 RGB and truth.json."""

    def __init__(self, folder):
        self.images = np.load(folder / "images.npy", mmap_mode="r")
        rows = json.loads((folder / "truth.json").read_text())["frames"]
        self.truth = [
            {
                name: np.array(frame[name], kind).reshape(-1, 4) if name == "boxes"
                else np.array(frame[name], kind)
                for name, kind in FIELDS.items()
            }
            for frame in rows
        ]


def chunk_folders(folder):
    """The complete chunks below `folder`; truth.json marks them, because it is written last."""
    return sorted(path.parent for path in Path(folder).glob("*/truth.json"))


class Pictures(Dataset):
    """The pictures of all chunks. With `augment`, a picture is changed differently each time.
    Pictures with the class `favour` (an index) count twice. `crops`: the share that is cropped.
    """

    def __init__(self, folders, augment, seed=0, favour=None, crops=0.75):
        self.chunks = [Chunk(folder) for folder in folders]
        self.index = [(c, i) for c, chunk in enumerate(self.chunks) for i in range(len(chunk.truth))]
        self.index += [(c, i) for c, i in self.index if favour in self.chunks[c].truth[i]["classes"]]
        self.augment, self.seed, self.crops = augment, seed, crops

    def __len__(self):
        return len(self.index)

    def __getitem__(self, key):
        """`key` is (n, picture). The running number n selects the augmentation."""
        look, picture = key
        chunk, i = self.index[picture]
        image, truth = np.array(self.chunks[chunk].images[i]), self.chunks[chunk].truth[i]
        if self.augment:
            image, truth = augmented(
                image, truth, np.random.default_rng((self.seed, look)), self.crops
            )
        return image, truth


class Looks(torch.utils.data.Sampler):
    """Batches of (n, picture) with n from `first` on. All pictures are shuffled in each round."""

    def __init__(self, count, batch, first, seed):
        self.count, self.batch, self.first, self.seed = count, batch, first, seed

    def __iter__(self):
        look, order, round_ = self.first, None, None
        while True:
            keys = []
            for _ in range(self.batch):
                if round_ != look // self.count:
                    round_ = look // self.count
                    order = np.random.default_rng((self.seed, 7, round_)).permutation(self.count)
                keys.append((look, int(order[look % self.count])))
                look += 1
            yield keys


def batch_of(samples):
    """Images (N, 3, 240, 320) uint8, channels last in memory, and ground truth, padded."""
    images = torch.from_numpy(np.stack([image for image, _ in samples])).permute(0, 3, 1, 2)
    most = max(1, max(len(truth["classes"]) for _, truth in samples))
    padded = {"mask": np.zeros((len(samples), most), bool)}
    for name, kind in FIELDS.items():
        shape = (len(samples), most, 4) if name == "boxes" else (len(samples), most)
        padded[name] = np.zeros(shape, kind)
        for i, (_, truth) in enumerate(samples):
            padded[name][i, : len(truth[name])] = truth[name]
            padded["mask"][i, : len(truth[name])] = True
    return images, {name: torch.from_numpy(values) for name, values in padded.items()}


def as_input(images):
    """Converts uint8 to the network's input, as in model.json: (pixel - 127.5) / 255."""
    return (images.float() - 127.5) / 255.0
