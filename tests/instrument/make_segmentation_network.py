#!/usr/bin/env python3
"""Writes a tiny segmentation network as ONNX: what is less red than half of what tissue is, is an instrument.

    make_segmentation_network.py FILE [--output sigmoid|logit|classes] [--size HEIGHT WIDTH] [--channels-last]
                                 [--normalized MEAN DEVIATION] [--flaw two-outputs|flat|unknown-layer]

With classes there are three: tissue, instrument, and one that never wins.
"""
import argparse
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "stereo"))
from make_network import block, image, node, number, tensor  # noqa: E402

LOGIT = [-40.0, 20.0, 20.0]  # of red, green, blue


def network(output, size, channels_last, normalized, flaw):
    weights = {"classes": [-w for w in LOGIT] + LOGIT + [0.0] * 3}.get(output, LOGIT)
    biases = {"classes": [-5.0, 5.0, -99.0]}.get(output, [5.0])
    count = len(biases)
    mean, deviation = normalized
    biases = [b + mean * sum(weights[3 * i : 3 * i + 3]) for i, b in enumerate(biases)]
    weights = [w * deviation for w in weights]
    tensors = [tensor("weights", (count, 3, 1, 1), weights), tensor("biases", (count,), biases)]
    nodes, source = [], "image"
    if channels_last:
        nodes.append(node("Transpose", ["image"], "planes", perm=[0, 3, 1, 2]))
        source = "planes"
    nodes.append(node("Conv", [source, "weights", "biases"], "scores", kernel_shape=[1, 1]))
    names = ["scores"]
    if output == "sigmoid":
        nodes.append(node("Sigmoid", ["scores"], "probability"))
        names = ["probability"]
    if flaw == "flat":
        nodes.append(node("Flatten", ["scores"], "flat"))
        names = ["flat"]
    if flaw == "two-outputs":
        nodes.append(node("Abs", ["scores"], "other"))
        names.append("other")
    if flaw == "unknown-layer":
        nodes.append(node("Bernoulli", ["scores"], "guessed"))
        names = ["guessed"]
    if channels_last:
        nodes.append(node("Transpose", [names[0]], "pixels", perm=[0, 2, 3, 1]))
        names[0] = "pixels"

    def described(name, channels):
        return image(name, size[0], (size[1], channels)) if channels_last else image(name, channels, size)

    graph = b"".join(block(1, n) for n in nodes) + block(2, "segmentation")
    graph += b"".join(block(5, t) for t in tensors) + block(11, described("image", 3))
    graph += b"".join(block(12, described(name, count)) for name in names)
    return number(1, 7) + block(2, "palpate") + block(7, graph) + block(8, block(1, "") + number(2, 13))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("file")
    parser.add_argument("--output", choices=["sigmoid", "logit", "classes"], default="sigmoid")
    parser.add_argument("--size", type=int, nargs=2, default=["height", "width"])
    parser.add_argument("--flaw", choices=["two-outputs", "flat", "unknown-layer"])
    parser.add_argument("--channels-last", action="store_true")
    parser.add_argument("--normalized", type=float, nargs=2, default=[0.0, 1.0])
    options = parser.parse_args()
    with open(options.file, "wb") as file:
        file.write(network(options.output, options.size, options.channels_last, options.normalized, options.flaw))


if __name__ == "__main__":
    main()
