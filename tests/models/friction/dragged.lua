-- A block dragged by a spring whose end moves slowly: stick-slip; friction decreases with speed, as an arc tangent.
local rd = require "refdyn"
local p = rd.parameters { { "w", 1e-6, "m/s" } }

return rd.model {
  name = "friction_dragged", links = { { "block", joint = "x", mass = 1 } },
  forces = function(s)
    local r = s.qd.block_x
    local level = 2 + 1.5 * rd.exp(-(r / 0.1) ^ 2)
    return { block_x = 40 * (0.05 * s.t - s.q.block_x) - level * 2 / rd.pi * rd.atan(r / p.w) }
  end,
}
