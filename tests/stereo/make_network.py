#!/usr/bin/env python3
"""Writes a tiny stereo network as ONNX, byte by byte, so that no package is needed.

    make_network.py FILE [--most-disparity 48] [--size HEIGHT WIDTH] [--flaw one-input|three-inputs|two-outputs|half-size]

Like large learned networks it compares the left image with the right one at every disparity, smooths the differences,
and takes the mean of the disparities weighted by a softmax (Kendall et al. 2017), but its weights are set by hand.
"""
import argparse
import struct


def varint(value):
    out = b""
    while value > 127:
        out += bytes([value & 127 | 128])
        value >>= 7
    return out + bytes([value])


def number(field, value):
    return varint(field << 3) + varint(value)


def block(field, value):
    data = value.encode() if isinstance(value, str) else value
    return varint(field << 3 | 2) + varint(len(data)) + data


def tensor(name, shape, values):
    dims = b"".join(number(1, size) for size in shape)
    return dims + number(2, 1) + block(8, name) + block(9, struct.pack(f"<{len(values)}f", *values))


def attribute(name, value):
    if isinstance(value, list):
        return block(1, name) + b"".join(number(8, v) for v in value) + number(20, 7)
    return block(1, name) + number(3, value) + number(20, 2)


def node(kind, inputs, output, **attributes):
    return (b"".join(block(1, name) for name in inputs) + block(2, output) + block(3, output) + block(4, kind)
            + b"".join(block(5, attribute(name, value)) for name, value in attributes.items()))


def image(name, channels, size):
    def dim(value):
        return block(1, number(1, value) if isinstance(value, int) else block(2, value))
    shape = b"".join(dim(d) for d in (1, channels, *size))
    return block(1, name) + block(2, block(1, number(1, 1) + block(2, shape)))


def network(most, size, flaw):
    count = most + 1
    weights = [
        tensor("grey_weights", (1, 3, 1, 1), [1 / 3] * 3),
        tensor("copies", (count, 1, 1, 1), [1.0] * count),
        # One channel per disparity: the right image moved to the right by so many pixels.
        tensor("shifts", (count, 1, 1, count), [float(k == most - d) for d in range(count) for k in range(count)]),
        tensor("sharpness", (1, 1, 1, 1), [-300.0]),
        tensor("disparities", (1, count, 1, 1), [float(d) for d in range(count)]),
    ]
    right = "left" if flaw == "one-input" else "right"
    stride = [2, 2] if flaw == "half-size" else [1, 1]
    one = {"kernel_shape": [1, 1]}
    nodes = [
        node("Conv", ["left", "grey_weights"], "left_grey", **one),
        node("Conv", [right, "grey_weights"], "right_grey", **one),
        node("Conv", ["left_grey", "copies"], "left_copies", **one),
        node("Conv", ["right_grey", "shifts"], "right_shifted", kernel_shape=[1, count], pads=[0, most, 0, 0]),
        node("Sub", ["left_copies", "right_shifted"], "difference"),
        node("Abs", ["difference"], "distance"),
        node("AveragePool", ["distance"], "cost", kernel_shape=[9, 9], pads=[4, 4, 4, 4], strides=stride),
        node("Mul", ["cost", "sharpness"], "score"),
        node("Softmax", ["score"], "share", axis=1),
        node("Conv", ["share", "disparities"], "disparity", **one),
    ]
    if flaw == "three-inputs":
        nodes.append(node("Add", ["disparity", "third"], "sum"))
    names = {"one-input": ["left"], "three-inputs": ["left", "right", "third"]}.get(flaw, ["left", "right"])
    outputs = {"three-inputs": ["sum"], "two-outputs": ["disparity", "left_grey"]}.get(flaw, ["disparity"])
    graph = b"".join(block(1, n) for n in nodes) + block(2, "stereo")
    graph += b"".join(block(5, w) for w in weights)
    graph += b"".join(block(11, image(name, 1 if name == "third" else 3, size)) for name in names)
    graph += b"".join(block(12, image(name, 1, size)) for name in outputs)
    return number(1, 7) + block(2, "palpate") + block(7, graph) + block(8, block(1, "") + number(2, 13))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("file")
    parser.add_argument("--most-disparity", type=int, default=48)
    parser.add_argument("--size", type=int, nargs=2, default=["height", "width"])
    parser.add_argument("--flaw", choices=["one-input", "three-inputs", "two-outputs", "half-size"])
    options = parser.parse_args()
    with open(options.file, "wb") as file:
        file.write(network(options.most_disparity, options.size, options.flaw))


if __name__ == "__main__":
    main()
