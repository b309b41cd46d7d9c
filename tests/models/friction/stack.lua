-- A block on a block on a plane; the upper one is shaken. Friction is linear between its two levels.
local rd = require "refdyn"
local p = rd.parameters { { "w", 1e-6, "m/s" } }
local function contact(rate, level) return -level * rd.max(-1, rd.min(1, rate / p.w)) end

return rd.model {
  name = "friction_stack", links = { { "low", joint = "x", mass = 2 }, { "top", on = "low", joint = "x", mass = 1 } },
  forces = function(s)
    return { low_x = 7 * rd.sin(3 * s.t) - 20 * s.q.low_x + contact(s.qd.low_x, 1.8), top_x = contact(s.qd.top_x, 2.2) }
  end,
}
