"""Computes every metric of tests/src/metrics.rs on its own, from two EXR files, and prints them as JSON.

    python metrics_check.py IMAGE.exr TRUTH.exr HIT.exr

HIT's red channel is above 0 where a pixel counts. FLIP comes from the package `flip-evaluator`; the rest is numpy in
double precision. Nothing here is shared with the Rust code: the two are compared by tests/tests/metrics_agree.rs.
"""

import json
import sys

import flip_evaluator
import numpy as np
import OpenEXR

REC709 = np.array([0.2126, 0.7152, 0.0722])


def read(path):
    """Rows of RGB from the top, float64."""
    with OpenEXR.File(path) as file:
        channels = file.channels()
        pixels = channels["RGB"].pixels if "RGB" in channels else np.dstack([channels[c].pixels for c in "RGB"])
    return pixels.astype(np.float64)


def exposure(truth):
    """What shows the geometric mean of the lit pixels' luminance, floored at 5 % of their mean, as 0.18."""
    luminance = truth @ REC709
    lit = luminance[luminance > 0]
    return 0.18 / np.exp(np.mean(np.log(np.maximum(lit, 0.05 * lit.mean()))))


def neutral(colour):
    """Khronos PBR Neutral tone mapper (2024)."""
    colour = np.maximum(colour, 0)
    low = colour.min(axis=-1, keepdims=True)
    colour = colour - np.where(low < 0.08, low - 6.25 * low**2, 0.04)
    peak = colour.max(axis=-1, keepdims=True)
    start, desaturation = 0.8 - 0.04, 0.15
    span = 1 - start
    with np.errstate(divide="ignore", invalid="ignore"):
        new_peak = 1 - span**2 / (peak + span - start)
        scaled = colour * (new_peak / peak)
    share = 1 - 1 / (desaturation * (peak - new_peak) + 1)
    return np.where(peak < start, colour, scaled * (1 - share) + new_peak * share)


def srgb8(colour):
    """sRGB in steps of a byte, as floats 0 to 1."""
    colour = np.clip(colour, 0, 1)
    encoded = np.where(colour <= 0.0031308, 12.92 * colour, 1.055 * colour ** (1 / 2.4) - 0.055)
    return np.floor(encoded * 255 + 0.5) / 255


def flip(image, truth, hit):
    """Mean FLIP over the pixels that count, of both pictures shown with the truth's exposure."""
    shown = [srgb8(neutral(np.where(hit[..., None], p, 0) * exposure(truth))) for p in (truth, image)]
    # A FLIP of two numpy pictures; it takes 32-bit floats.
    reference, test = [np.ascontiguousarray(p, dtype=np.float32) for p in shown]
    error, _, _ = flip_evaluator.evaluate(reference, test, "LDR", applyMagma=False, parameters={"ppd": 67.0})
    return np.asarray(error, dtype=np.float64).reshape(hit.shape)[hit].mean()


def largest_jump(error, hit):
    """Largest difference between horizontal or vertical neighbours that both count."""
    across = np.abs(np.diff(error, axis=1))[hit[:, 1:] & hit[:, :-1]]
    down = np.abs(np.diff(error, axis=0))[hit[1:] & hit[:-1]]
    return max(across.max(initial=0), down.max(initial=0))


def metrics(image, truth, hit):
    a, b = image[hit], truth[hit]
    error = (image - truth) @ REC709
    mean_luminance = (b @ REC709).mean()
    floor = 0.01 * b.mean()
    ranked = np.sort(np.abs(error[hit]))
    return {
        "relative_rmse": np.sqrt(((a - b) ** 2).mean() / (b**2).mean()),
        "rel_mse": ((a - b) ** 2 / (b**2 + floor**2)).mean(),
        "signed_energy": a.sum() / b.sum() - 1,
        "p99": ranked[int(np.ceil(0.99 * len(ranked))) - 1] / mean_luminance,
        "largest_jump": largest_jump(error, hit) / mean_luminance,
        "flip": flip(image, np.where(hit[..., None], truth, 0), hit),
        # The change from the truth to the image, as if they were two frames.
        "frame_change": np.linalg.norm(a - b) / np.linalg.norm(b),
        "pixels": int(hit.sum()),
    }


def main():
    if len(sys.argv) != 4:
        sys.exit("usage: python metrics_check.py IMAGE.exr TRUTH.exr HIT.exr")
    image, truth, hit = [read(path) for path in sys.argv[1:]]
    if not image.shape == truth.shape == hit.shape:
        sys.exit(f"the files differ in size: {image.shape}, {truth.shape}, {hit.shape}")
    print(json.dumps(metrics(image, truth, hit[..., 0] > 0)))


if __name__ == "__main__":
    main()
