r"""Exposures of one scene in, one map of its radiance out.

A frame of exposure t shows a pixel at level z, so the sensor saw the irradiance g of that level
and the scene has the radiance g/t. Of the frames that show the pixel properly the maximum
likelihood mean is taken,

.. math:: \hat x = \sum w_k x_k / \sum w_k,\quad x_k = g_k/t_k,\quad w_k = t_k^2/\sigma_k^2,
   \quad \sigma^2 = u I + v + \Delta^2/12 + s^2,

with u and v the sensor's noise, Δ the irradiance that a level covers and s the calibration's own
error: the inverse variance weights of [1]_ and [2]_ in place of a hat function of the level [3]_.

**What the weights are taken at.** A level that noise pushed down has a smaller variance by this
formula than one that it pushed up, so weights at the shown levels pull the mean down: of two
frames of equal exposure by half the squared relative noise, 4 % where that is 0.3. Hence two
sweeps over the frames: the first weighs by the shown level, the second by uI + v at I = t x̂ of
the first. To first order in the variance nothing is left of the bias. Δ and s stay those of the
level: where they matter, the level is not noisy, or they change slowly.

**What clipping does.** Near white, noise that raises a level makes it saturate and drop out, and
what stays is too dark; near black what is clipped at 0 is too bright. So the second sweep also
decides by what is expected and not by what is shown which frames serve: those with t x̂ at least
three deviations from white and from black, if there is one. With inverse variance weights the
mean does not depend on how the frames scatter around it, so choosing by the mean of all does not
bias it; choosing by the mean of the chosen would, so there is no third sweep.
What is saturated counts as saturated in all exposures a quarter longer and more, whatever they
show.

References
----------
.. [1] Granados et al. (2010), "Optimal HDR reconstruction with linear digital cameras", CVPR,
   doi:10.1109/CVPR.2010.5540208.
.. [2] Hasinoff, Durand & Freeman (2010), "Noise-optimal capture for high dynamic range
   photography", CVPR, doi:10.1109/CVPR.2010.5540167.
.. [3] Debevec & Malik (1997), "Recovering high dynamic range radiance maps from photographs",
   SIGGRAPH, doi:10.1145/258734.258884.
"""

from chartless.merge._map import RadianceMap as RadianceMap
from chartless.merge._radiance import grey_factors as grey_factors
from chartless.merge._radiance import merge_frames as merge_frames
from chartless.merge._tables import DEFAULT_NOISE as DEFAULT_NOISE
from chartless.merge._tables import DEVIATIONS as DEVIATIONS
