-- A block on a spring rides on a belt; friction decreases with the sliding speed.
local rd = require "refdyn"
local p = rd.parameters { { "w", 1e-6, "m/s" } }

return rd.model {
  name = "friction_belt", links = { { "block", joint = "x", mass = 1 } },
  forces = function(s)
    local r = s.qd.block_x - 0.1
    return { block_x = -100 * s.q.block_x - rd.tanh(r / p.w) * (4 + 4 * rd.exp(-rd.abs(r) / 0.05)) }
  end,
}
