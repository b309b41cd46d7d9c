-- expect: 10: warning: gravity: 9810 m/s^2; if it is in mm/s^2, convert it to m/s^2
-- expect: 13: warning: links[1].turn[1]: angle of 90 rad; if it is in degrees, multiply by rd.pi / 180
-- expect: 13: warning: link rod: at: 1100 m from its carrier; if it is in mm, convert it to m
-- expect: 13: warning: link rod: start: psi = 45 rad; if it is in degrees, multiply by rd.pi / 180
-- expect: 13: warning: link rod: beam: 2000 m long; if it is in mm, convert it to m
-- expect: 13: warning: link rod: beam: E = 210000 Pa, very small; if it is in MPa or GPa, convert it to Pa
-- expect: 13: warning: link rod: beam: rho = 7.8 kg/m^3, very small; if it is in g/cm^3, convert it to kg/m^3
-- expect: 18: hold[1]: unknown coordinate "rod_x"; use one of rod_psi, rod_psi_1, rod_theta_1, rod_phi_1, spin_psi, empty_x, empty_phi
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
