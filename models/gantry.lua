-- A gantry: bridge, trolley and ram on three slides at right angles, each driven along a given motion against friction.
-- Checked against closed forms: the mass matrix is the diagonal matrix of the carried masses, and the force of each drive
-- is the carried mass times its acceleration, plus friction and, for the ram, the weight.
local rd = require "refdyn"
local p  = rd.parameters {
  { "g", 9.81, "m/s^2" }, { "steel", 7850, "kg/m^3" }, { "m_load", 20, "kg" }, { "T", 2, "s" },
  { "reach_x", 1.5, "m" }, { "reach_y", -0.8, "m" }, { "reach_z", -0.6, "m" },
  { "drag", 40, "N" }, { "slow", 0.01, "m/s" },
}
local function course(t, reach) return reach * rd.smoothstep(t, 0, p.T) end

return rd.model {
  name = "gantry", gravity = { 0, 0, -p.g },
  links = {
    { "bridge", at = { 0, 0, 2 }, joint = "x",
      bodies = { rd.box { { 0.2, 3, 0.1 }, density = p.steel },
                 rd.box { { 0.3, 0.1, 0.3 }, mass = 15, at = { 0, 1.5, 0 } },
                 rd.box { { 0.3, 0.1, 0.3 }, mass = 15, at = { 0, -1.5, 0 } } } },
    { "trolley", on = "bridge", joint = "y", mass = 25, inertia = { xx = 0.4, yy = 0.4, zz = 0.5 } },
    { "ram", on = "trolley", at = { 0.2, 0, 0 }, joint = "z",
      bodies = { rd.tube { outer = 0.08, inner = 0.06, length = 1.2, axis = "z", density = p.steel,
                           at = { 0, 0, -0.6 } },
                 { mass = p.m_load, center = { 0, 0, -1.3 } } } },
  },
  points = { tool = { on = "ram", at = { 0, 0, -1.3 } } },
  forces = function(s)
    return { bridge_x = rd.friction(2 * p.drag, s.qd.bridge_x, p.slow),
             trolley_y = rd.friction(p.drag, s.qd.trolley_y, p.slow) }
  end,
  constraints = function(s)
    return {
      rd.drive { "bridge_x", course(s.t, p.reach_x) }, rd.drive { "trolley_y", course(s.t, p.reach_y) },
      rd.drive { "ram_z", course(s.t, p.reach_z) },
    }
  end,
}
