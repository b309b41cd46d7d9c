-- A SCARA robot with two flexible links on the cycle by which such robots are compared: 25 mm up, 305 mm across, 25 mm
-- down, and back. Its motors follow the angles that rigid links would need, so the tool swings. Lengths are from ABB's IRB
-- 910SC-3/0.65; sections and masses are our own. Checked with rigid links: the cycle, and the torques of a two-link arm in
-- closed form. Checked with flexible links: the sag of the tool, by Castigliano's theorem.
local rd = require "refdyn"
local n  = rd.option("n_rfe", 2, { from = 1 })                          -- of each link
local p  = rd.parameters {
  { "L1", 0.4, "m" }, { "L2", 0.25, "m" }, { "E", 7e10, "Pa" }, { "nu", 0.33, "1" }, { "rho", 2700, "kg/m^3" },
  { "m_elbow", 1.5, "kg" }, { "m_tool", 1, "kg" }, { "g", 9.81, "m/s^2" },
  { "x", 0.4, "m" }, { "across", 0.305, "m" }, { "up", 0.025, "m" }, { "T", 0.75, "s" },
}

-- Prescribed position of the tool, and the joint angles for it. T is the time from one end of the cycle to the other.
local function step(t, from, to) return rd.smoothstep(t, from * p.T, to * p.T) end
local function y_of(t) return p.across * (step(t, 0.1, 0.9) - step(t, 1.1, 1.9) - 0.5) end
local function z_of(t) return p.up * (step(t, 0, 0.2) - step(t, 0.8, 1) + step(t, 1, 1.2) - step(t, 1.8, 2)) end
local function angles(t)
  local x, y  = p.x, y_of(t)
  local lower = rd.acos((x^2 + y^2 - p.L1^2 - p.L2^2) / (2 * p.L1 * p.L2))
  return rd.atan2(y, x) - rd.atan2(p.L2 * rd.sin(lower), p.L1 + p.L2 * rd.cos(lower)), lower
end

local function beam(length, outer)
  return { length = length, section = rd.tube(outer, 0.9 * outer), E = p.E, nu = p.nu, rho = p.rho, rfe = n,
           damping = { ratio = 0.01 } }
end
local upper, lower = angles(0)

return rd.model {
  name = "scara", gravity = { 0, 0, -p.g },
  links = {
    { "upper", at = { 0, 0, 0.2 }, joint = "psi", start = { psi = upper }, beam = beam(p.L1, 0.04),
      bodies = { rd.cylinder { diameter = 0.1, length = 0.2, axis = "z", mass = 4, at = { 0, 0, -0.1 } } },
      rotor = { psi = { inertia = 2e-5, gear = 80 } } },
    { "lower", on = "upper.tip", joint = "psi", start = { psi = lower }, beam = beam(p.L2, 0.03),
      bodies = { rd.cylinder { diameter = 0.06, length = 0.08, axis = "z", mass = p.m_elbow } },
      rotor = { psi = { inertia = 1e-5, gear = 50 } } },
    { "quill", on = "lower.tip", joint = "z",
      bodies = { rd.cylinder { diameter = 0.02, length = 0.25, axis = "z", mass = p.m_tool } } },
  },
  points = { tool = { on = "quill", at = { 0, 0, -0.125 } } },
  constraints = function(s)
    local upper, lower = angles(s.t)
    return { rd.drive { "upper_psi", upper }, rd.drive { "lower_psi", lower }, rd.drive { "quill_z", z_of(s.t) } }
  end,
}
