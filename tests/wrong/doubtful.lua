-- expect: 10: warning: gravity: 9810 m/s^2: in mm/s^2? m/s^2 are needed
-- expect: 13: warning: links[1].turn[1]: an angle of 90 rad: in degrees? rd.pi / 180 makes radians of them
-- expect: 13: warning: link rod: at: 1100 m from its carrier: in mm? m are needed
-- expect: 13: warning: link rod: start: psi = 45 rad: in degrees? rd.pi / 180 makes radians of them
-- expect: 13: warning: link rod: beam: 2000 m long: in mm? m are needed
-- expect: 13: warning: link rod: beam: E = 210000 Pa: in MPa or GPa? Pa are needed
-- expect: 13: warning: link rod: beam: rho = 7.8 kg/m^3: in g/cm^3? kg/m^3 are needed
-- expect: 18: hold[1]: unknown coordinate "rod_x", the nearest known one is "rod_psi"
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9810 },
  links = {
    { "rod", turn = { { "x", 90 } }, joint = "psi", start = { psi = 45 }, at = { 0, 0, 1100 },
      beam = { length = 2000, section = rd.round(14), E = 210000, nu = 0.3, rho = 7.8, rfe = 2 } },
    { "spin", joint = "psi", mass = 1, inertia = { zz = 1 } },
    { "empty", joint = "x, phi", start = { phi = 1 } },
  },
  hold = "rod_x",
}
