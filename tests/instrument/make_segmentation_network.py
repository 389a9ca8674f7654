#!/usr/bin/env python3
"""Writes a tiny segmentation network as ONNX: what is less red than half of what tissue is, is an instrument.

    make_segmentation_network.py FILE [--output sigmoid|logit|classes] [--size HEIGHT WIDTH] [--flaw two-outputs|flat]

With classes there are three: tissue, instrument, and one that never wins.
"""
import argparse
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "stereo"))
from make_network import block, image, node, number, tensor  # noqa: E402

LOGIT = [-40.0, 20.0, 20.0]  # of red, green, blue


def network(output, size, flaw):
    weights = {"classes": [-w for w in LOGIT] + LOGIT + [0.0] * 3}.get(output, LOGIT)
    biases = {"classes": [-5.0, 5.0, -99.0]}.get(output, [5.0])
    count = len(biases)
    tensors = [tensor("weights", (count, 3, 1, 1), weights), tensor("biases", (count,), biases)]
    nodes = [node("Conv", ["image", "weights", "biases"], "scores", kernel_shape=[1, 1])]
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
    graph = b"".join(block(1, n) for n in nodes) + block(2, "segmentation")
    graph += b"".join(block(5, t) for t in tensors) + block(11, image("image", 3, size))
    graph += b"".join(block(12, image(name, count, size)) for name in names)
    return number(1, 7) + block(2, "palpate") + block(7, graph) + block(8, block(1, "") + number(2, 13))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("file")
    parser.add_argument("--output", choices=["sigmoid", "logit", "classes"], default="sigmoid")
    parser.add_argument("--size", type=int, nargs=2, default=["height", "width"])
    parser.add_argument("--flaw", choices=["two-outputs", "flat"])
    options = parser.parse_args()
    with open(options.file, "wb") as file:
        file.write(network(options.output, options.size, options.flaw))


if __name__ == "__main__":
    main()
