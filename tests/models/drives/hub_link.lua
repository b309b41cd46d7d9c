local rd = require "refdyn"
local n = rd.option("n_rfe", 9)
local order = rd.option("degree", 9)
local p = rd.parameters { { "T", 1, "s" }, { "phi", rd.pi / 2, "rad" }, { "eta", 0, "s" }, {"J", 0.02, "kg m^2"}, {"m_tip", 0.1, "kg"}}
return rd.model {
  name = "hublink", gravity = { 0, 0, 0 },
  links = {
    { "hub", joint = "psi", mass = 1, inertia = { zz = p.J } },
    { "arm", on = "hub", beam = { length = 1, section = rd.rectangle(0.005, 0.03), E = 7e10, nu = 0.33, rho = 2700, eta = p.eta, rfe = n, dofs = "psi" } },
    { "tip", on = "arm.tip", mass = p.m_tip },
  },
  points = { tip = "tip" },
  drives = { "hub_psi" },
  constraints = function(s)
    return { rd.position { rd.atan2(s.points.tip.y, s.points.tip.x) - p.phi * rd.smoothstep(s.t, 0, p.T, order), name = "polar" } }
  end,
}
