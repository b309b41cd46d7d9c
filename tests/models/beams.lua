-- A clamped beam of three segments: a square bar, a rectangle with curvature, a tube; another link hangs from its
-- middle. By hand (E = 70 GPa, G = E / (2 (1 + 0.25)) = 28 GPa; dl = 0.2 m in each segment):
--   square 20 mm:   I = 0.02^4 / 12, It = 0.1405770 0.02^4 (series): E I / dl = 4666.667, G It / dl = 3148.925 N m
--   30 x 10 mm:     Iz = 0.01 0.03^3 / 12, Iy = 0.03 0.01^3 / 12: 7875 and 875 N m; It = 0.263318 0.03 0.01^3 gives
--                   G It / dl = 1105.9 N m; its element starts and rests at 0.5 0.2 = 0.1 rad about z
--   tube 20/16 mm:  I = pi/64 (0.02^4 - 0.016^4): 1622.95 N m, times 2 / 2.5 in torsion: 1298.36 N m
--   damping: eta = 2 0.01 / (2 pi 10 Hz) = 3.18310e-4 s in the first; the given 0.7 N m s in the others.
-- Arc of the curved element: the place along = 0.5 is 0.1 m beyond the first segment's end, at its element.
local rd = require "refdyn"

return rd.model {
  name = "beams", gravity = { 0, 0, -9.81 },
  links = {
    { "boom",
      beam = { E = 7e10, nu = 0.25, rho = 2700, damping = { psi = 0.7, theta = 0.7, phi = 0.7 },
               segments = {
                 { length = 0.4, section = rd.rectangle(0.02, 0.02), rfe = 3, damping = { ratio = 0.01, frequency = 10 } },
                 { length = 0.2, section = rd.rectangle(0.03, 0.01), rfe = 2, curvature = { psi = 0.5 } },
                 { length = 0.2, section = rd.tube(0.02, 0.016), rfe = 2, E = 7e10 },
               } } },
    { "middle", on = "boom", along = 0.5, at = { 0, 0, -0.1 }, mass = 0.3 },
  },
  points = { middle = "middle", same = { on = "boom", along = 0.5 }, tip = "boom.tip" },
}
