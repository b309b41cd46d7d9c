-- Solids of every kind on one hinge about z and on a slide. By hand, with the origin on the hinge:
--   box      0.3 x 0.2 x 0.1 m, 1000 kg/m^3: 6 kg; 6 (0.3^2 + 0.2^2) / 12 + 6 0.5^2           = 1.565
--   cylinder diameter 0.2, length 0.4, 3 kg, axis y: 3 (3 0.1^2 + 0.4^2) / 12 + 3 0.2^2       = 0.1675
--   tube     diameters 0.2 and 0.1, length 1, 2 kg, its axis x turned to z: 2 (0.1^2 + 0.05^2) / 2 = 0.0125
--   sphere   diameter 0.2, 5 kg: 2/5 5 0.1^2 + 5 0.1^2                                        = 0.07
--   body     1.5 kg, centre 0.4 from the hinge, zz = 0.02: 0.02 + 1.5 0.4^2                   = 0.26
--   point    0.5 kg, 1 m from the hinge                                                       = 0.5
-- M = [18 0; 0 2.575] at psi = 0 except for the coupling of slide y and hinge, sum m x = 6 0.5 + 5 0.1 + 0.5 1 = 4.
local rd = require "refdyn"

return rd.model {
  name = "bodies", gravity = { 0, -9.81, 0 },
  links = {
    { "hub", joint = "y, psi", mass = 0.5, center = { 1, 0, 0 },
      bodies = {
        rd.box { { 0.3, 0.2, 0.1 }, density = 1000, at = { 0.5, 0, 0 } },
        rd.cylinder { diameter = 0.2, length = 0.4, mass = 3, axis = "y", at = { 0, 0.2, 0 } },
        rd.tube { outer = 0.2, inner = 0.1, length = 1, mass = 2, turn = { { "y", rd.pi / 2 } } },
        rd.sphere { diameter = 0.2, mass = 5, at = { 0.1, 0, 0 } },
        { mass = 1.5, center = { 0, 0.3, 0 }, at = { 0, 0.7, 0 }, turn = { { "x", rd.pi } },
          inertia = { xx = 0.02, yy = 0.02, zz = 0.02 } },
      } },
  },
  points = { E = { on = "hub", at = { 1, 0, 0 } } },
}
