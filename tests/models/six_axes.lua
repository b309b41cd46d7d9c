-- A robot with six axes and the lengths and masses of a UR5 (Universal Robots), whose forearm bends. Drives are inputs.
local rd = require "refdyn"
local n  = rd.option("n_rfe", 2, { from = 1 })
local p  = rd.parameters { { "E", 7e10, "Pa" }, { "rho", 2700, "kg/m^3" }, { "payload", 1, "kg" } }
local names = { "pan", "lift", "elbow", "wrist1", "wrist2", "wrist3" }
local forces = {}
for _, name in ipairs(names) do forces[name .. "_psi"] = rd.input("tau_" .. name, 0, "N m") end

local function body(mass, center, radius)
  local i = mass * radius ^ 2
  return { mass = mass, center = center, inertia = { xx = i, yy = i, zz = i } }
end

return rd.model {
  name = "six_axes", gravity = { 0, 0, -9.81 },
  links = {
    { "pan", at = { 0, 0, 0.089159 }, joint = "psi", bodies = { body(3.7, { 0, 0, 0 }, 0.07) } },
    { "lift", on = "pan", at = { 0, 0.13585, 0 }, turn = { { "x", rd.pi / 2 } }, joint = "psi", start = { psi = 1 },
      damper = { psi = 2 }, bodies = { body(8.393, { 0.2125, 0, 0 }, 0.15) } },
    { "elbow", on = "lift", at = { 0.425, 0, 0 }, joint = "psi", start = { psi = -1.6 }, damper = { psi = 2 },
      beam = { length = 0.39225, section = rd.tube(0.05, 0.045), E = p.E, nu = 0.33, rho = p.rho, eta = 1e-5, rfe = n } },
    { "wrist1", on = "elbow.tip", at = { 0, 0, -0.1 }, joint = "psi", damper = { psi = 0.5 }, bodies = { body(1.219, { 0, 0, 0.05 }, 0.05) } },
    { "wrist2", on = "wrist1", at = { 0, 0, 0.1 }, turn = { { "x", rd.pi / 2 } }, joint = "psi", damper = { psi = 0.5 },
      bodies = { body(1.219, { 0, 0, 0.05 }, 0.05) } },
    { "wrist3", on = "wrist2", at = { 0, 0, 0.1 }, turn = { { "x", -rd.pi / 2 } }, joint = "psi", damper = { psi = 0.2 },
      bodies = { body(0.1879, { 0, 0, 0 }, 0.03), { mass = p.payload, center = { 0, 0, 0.05 }, inertia = { xx = 1e-3, yy = 1e-3, zz = 1e-3 } } } },
  },
  points = { tool = { on = "wrist3", at = { 0, 0, 0.0823 } } },
  forces = function(s) return forces end,
}
