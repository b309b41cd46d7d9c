-- Damping as the ratio of a mode: a clamped steel rod of 20 mm and 1 m. By hand: omega = b^2 sqrt(E I / (rho A L^4)),
-- sqrt(E / rho) d / 4 = 25.318 1/s with E = 2e11, rho = 7800:
--   alone, mode 1, b = 1.875104: 89.02 rad/s;  eta = 2 0.005 / omega = 1.12334e-4 s
--   with a mass at the tip as large as its own, b = 1.247917: 39.43 rad/s; eta = 2.53624e-4 s
-- The options `tip` and `mode` select the case: the damping of the element is eta times its stiffness E I / 1 m =
-- 1570.796 N m.
local rd = require "refdyn"
local tip, mode = rd.option("tip", false), rd.option("mode", 1)
local area = rd.pi * 0.02^2 / 4

return rd.model {
  name = "damping_ratio",
  links = {
    { "rod", beam = { length = 1, section = rd.round(0.02), E = 2e11, nu = 0.3, rho = 7800, rfe = 2, dofs = "psi",
                      damping = { ratio = 0.005, mode = mode, tip_mass = tip and 7800 * area or 0 } } },
  },
}
