"""How alike two pictures look: the structural similarity index.

Z. Wang, A. C. Bovik, H. R. Sheikh and E. P. Simoncelli, "Image quality assessment: from error visibility to structural
similarity", IEEE Transactions on Image Processing 13 (2004), equation 13, with the constants and the 11 × 11 Gaussian
window of 1.5 pixels that they state; averaged over the picture, or over a part of it.
"""

from scipy.ndimage import gaussian_filter


def structural_similarity(one, other, part=None):
    """Return the mean index of two pictures (height, width, 3) in 0 to 255; 1 where they are the same."""
    x, y = (picture.astype(float) @ [0.299, 0.587, 0.114] for picture in (one, other))

    def mean(values):
        return gaussian_filter(values, 1.5, truncate=3.5)

    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    mx, my = mean(x), mean(y)
    vx, vy, vxy = mean(x * x) - mx**2, mean(y * y) - my**2, mean(x * y) - mx * my
    index = (2 * mx * my + c1) * (2 * vxy + c2) / ((mx**2 + my**2 + c1) * (vx + vy + c2))
    return float(index[part or ...].mean())
