"""Writes a checkpoint's weights as ONNX (opset 11, input of any size) and compares OpenCV's answer with torch's.

    python3 export.py CHECKPOINT OUT.onnx [EARLIER SHARE]

With the checkpoint of an earlier run from which this one went on: the mean of both runs' weights, SHARE of the earlier.
What either has forgotten the other may know.
"""

import sys
import time

import cv2
import numpy as np
import torch

from network import InstrumentNet


def main(checkpoint, out, earlier=None, share=0):
    weights = torch.load(checkpoint)["average"]
    if earlier:
        for name, value in torch.load(earlier)["average"].items():
            if value.dtype.is_floating_point:
                weights[name].mul_(1 - float(share)).add_(value, alpha=float(share))
    network = InstrumentNet()
    network.load_state_dict(weights)
    network.eval()
    picture = torch.rand(1, 3, 192, 320)
    torch.onnx.export(network, picture, out, opset_version=11, input_names=["rgb"], output_names=["logits"],
                      dynamic_axes={"rgb": {2: "height", 3: "width"}, "logits": {2: "height", 3: "width"}})
    cv2.setNumThreads(1)
    opencv = cv2.dnn.readNetFromONNX(out)
    for size in ((192, 320), (224, 288)):
        picture = torch.rand(1, 3, *size)
        opencv.setInput(picture.numpy())
        answer = opencv.forward()
        times = []
        for _ in range(20):
            opencv.setInput(picture.numpy())
            begin = time.process_time()
            opencv.forward()
            times.append(1000 * (time.process_time() - begin))
        difference = np.abs(answer - network(picture).detach().numpy()).max()
        print(f"{size[1]} x {size[0]}: largest difference {difference:.1e}, {np.median(times):.1f} ms of one core")


if __name__ == "__main__":
    main(*sys.argv[1:5])
