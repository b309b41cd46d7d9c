-- A block at rest on a plane is pushed back and forth: it sticks, slides and sticks again; the friction level is constant.
local rd = require "refdyn"
local p = rd.parameters { { "w", 1e-6, "m/s" } }

return rd.model {
  name = "friction_slide", links = { { "block", joint = "x", mass = 1 } },
  forces = function(s) return { block_x = 2 * rd.sin(3 * s.t) + rd.friction(1.3, s.qd.block_x, p.w) } end,
}
