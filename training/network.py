"""The network: a small U-Net. It looks at the colours and at their logarithmic ratios, as they are and relative to those of
the whole picture: light and shadow leave ratios alone, and most of a picture is tissue."""

import torch
import torch.nn as nn
import torch.nn.functional as F

CHANNELS = (12, 24, 44, 80, 112)  # at 1/2, 1/4, 1/8, 1/16 and 1/32 of the picture's size


def block(inputs, outputs, stride=1, size=3):
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, size, stride, size // 2, bias=False), nn.BatchNorm2d(outputs), nn.ReLU(inplace=True)
    )


class InstrumentNet(nn.Module):
    """RGB from 0 to 1, N x 3 x height x width (multiples of 32) -> logits of the instrument, N x 1 x height x width."""

    def __init__(self, channels=CHANNELS):
        super().__init__()
        a, b, c, d, e = channels
        self.ratios = nn.Conv2d(3, 3, 1, bias=False)
        self.ratios.weight.data = torch.tensor([[1.0, -1, 0], [0, 1, -1], [1 / 3, 1 / 3, 1 / 3]])[:, :, None, None]
        self.ratios.weight.requires_grad = False
        self.relative = nn.InstanceNorm2d(3, eps=1e-3)
        self.down1 = block(9, a, 2)
        self.down2 = nn.Sequential(block(a, b, 2), block(b, b))
        self.down3 = nn.Sequential(block(b, c, 2), block(c, c))
        self.down4 = nn.Sequential(block(c, d, 2), block(d, d))
        self.down5 = nn.Sequential(block(d, e, 2), block(e, e))
        self.up4 = nn.Sequential(block(e + d, d, size=1), block(d, d))
        self.up3 = nn.Sequential(block(d + c, c, size=1), block(c, c))
        self.up2 = nn.Sequential(block(c + b, b, size=1), block(b, b))
        self.up1 = nn.Sequential(block(b + a, a, size=1), block(a, a))
        self.logits = nn.ConvTranspose2d(a, 1, 4, 2, 1)
        nn.init.constant_(self.logits.bias, -1.5)

    def forward(self, rgb):
        ratios = self.ratios(torch.log(rgb + 0.06))
        x1 = self.down1(torch.cat([(rgb - 0.4) * 4.0, self.relative(ratios), ratios], 1))
        x2 = self.down2(x1)
        x3 = self.down3(x2)
        x4 = self.down4(x3)
        x5 = self.down5(x4)
        double = lambda x: F.interpolate(x, scale_factor=2.0, mode="nearest")
        y = self.up4(torch.cat([double(x5), x4], 1))
        y = self.up3(torch.cat([double(y), x3], 1))
        y = self.up2(torch.cat([double(y), x2], 1))
        y = self.up1(torch.cat([double(y), x1], 1))
        return self.logits(y)
