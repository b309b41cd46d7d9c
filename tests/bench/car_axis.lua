-- The car axis of the Test Set for IVP Solvers (Mazzia and Magherini): two point masses at the ends of a rigid rod, each
-- on a stiff spring; the left spring stands on a flat ground, the right one on a bumpy one. Its equations, divided by
-- eps^2: masses M/2, springs 1/eps^2, four redundant coordinates and two rows.
local rd = require "refdyn"
local p = rd.parameters {
  { "M", 10, "kg" }, { "k", 1e4, "N/m" }, { "L", 1, "m" }, { "rest", 0.5, "m" }, { "g", 1, "m/s^2" },
  { "bump", 0.1, "m" }, { "w", 10, "rad/s" }, { "alpha", 100, "1/s" }, { "beta", 100, "1/s" },
}

return rd.model {
  name = "car_axis", gravity = { 0, 0, -p.g },
  links = {
    { "left", joint = { "x", "z" }, start = { z = 0.5 }, start_rate = { x = -0.5 }, mass = p.M / 2 },
    { "right", joint = { "x", "z" }, start = { x = 1, z = 0.5 }, start_rate = { x = -0.5 }, mass = p.M / 2 },
  },
  points = { l = "left", r = "right" },
  forces = function(s)
    local q, forces, zb = s.q, {}, p.bump * rd.sin(p.w * s.t)
    local function spring(name, x, z)
      local pull = p.k * (p.rest / (x^2 + z^2)^0.5 - 1)
      forces[name .. "_x"], forces[name .. "_z"] = pull * x, pull * z
    end
    spring("left", q.left_x, q.left_z)
    spring("right", q.right_x - (p.L^2 - zb^2)^0.5, q.right_z - zb)
    return forces
  end,
  constraints = function(s)
    local q, zb = s.q, p.bump * rd.sin(p.w * s.t)
    local xb = (p.L^2 - zb^2)^0.5
    return {
      rd.position { xb * q.left_x + zb * q.left_z, alpha = p.alpha, beta = p.beta, name = "left" },
      rd.position { (q.left_x - q.right_x)^2 + (q.left_z - q.right_z)^2 - p.L^2, alpha = p.alpha, beta = p.beta,
                    name = "rod" },
    }
  end,
}
