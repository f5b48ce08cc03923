"""Equilibria of the hemitropic rod, computed by multiple shooting with an adaptive 8th-order Runge-Kutta method.

Residuals are below 1e-12; no finite element code had a part in it.  Loads of folds, secondary branch points and of the
end where the stretch vanishes solve the boundary value problem together with the condition that defines them.
"""

FIRST = {  # load: (ordinate, energy), the branch from the first buckling load; constants (-3, 1, 1, 3)
    0.2: (0.980883718529, 0.974313936697),
    0.5: (1.729034550256, 2.922530402606),
    0.7: (1.516855961117, 3.829156837512),
    0.9: (1.307652396076, 3.659252898179),
    0.95: (1.309486149866, 3.629038527358),
}
FOLD = (0.3216500865569, 0.280882264583, 3.107991375393)  # load, ordinate, energy, on the branch from the second
AROUND_FOLD = {0.325: (0.171727618404, 0.373209371916)}  # load: ordinates before and after the fold
SECOND = {0.5: (0.629008508523, 5.570328105323)}  # load: (ordinate, energy) after the fold
ZERO_STRETCH = (0.6123887919, 0.4451244765)  # load, ordinate

PITCHFORK = (0.7241930044116, 2.298049000665)  # on the first branch; constants (0, 1, 1, 3)
BEYOND_PITCHFORK = {0.9: 1.983310146306}  # load: ordinate on the branch that leaves it

FOLD_OF_SECOND = 0.3534002860735  # constants (-2, 1, 1, 3)
ZERO_STRETCH_OF_THIRD = 0.9117053887  # constants (-2, 1, 1, 3)
FOLD_OF_THIRD = 0.3029420989972  # constants (-3, 1, 1, 4)
