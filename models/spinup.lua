-- Spin-up of a flexible arm: its hub accelerates from rest to 6 rad/s within 15 s. This exceeds the arm's first natural
-- frequency, 3.8 rad/s; without the tension due to the centrifugal force the deflection would grow without bound. The tip
-- lags by 0.57 m and returns. The benchmark of Kane, Ryan and Banerjee (Journal of Guidance, Control, and Dynamics 10, 1987)
-- with the data of Simo and Vu-Quoc (Journal of Applied Mechanics 53, 1986, part II): 10 m, EI = 1.4e4 N m^2, 1.2 kg/m.
-- Checked against the assumed modes of a beam under this tension.
local rd = require "refdyn"
local n  = rd.option("n_rfe", 8, { from = 2 })
local p  = rd.parameters {
  { "L", 10, "m" }, { "E", 7e10, "Pa" }, { "nu", 0.3, "1" }, { "rho", 3000, "kg/m^3" },
  { "rate", 6, "rad/s" }, { "T", 15, "s" },
}

local function turn(t)
  local w, rising = 2 * rd.pi / p.T, rd.min(t, p.T)
  return p.rate / p.T * (rising^2 / 2 + (rd.cos(w * rising) - 1) / w^2) + p.rate * rd.max(t - p.T, 0)
end

return rd.model {
  name = "spinup",
  links = {
    { "arm", joint = "psi",
      beam = { length = p.L, section = { area = 4e-4, Iy = 2e-7, Iz = 2e-7, It = 4e-7 }, E = p.E, nu = p.nu,
               rho = p.rho, rfe = n, dofs = "psi" } },
  },
  points = { tip = "arm.tip" },
  courses = function(s)
    local tip, psi = s.points.tip, turn(s.t)
    return { deflection = tip.y * rd.cos(psi) - tip.x * rd.sin(psi) }   -- of the tip, seen from the hub
  end,
  constraints = function(s) return { rd.drive { "arm_psi", turn(s.t), alpha = 20, beta = 20 } } end,
}
