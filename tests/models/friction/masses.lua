-- Two blocks on one belt, coupled by a spring, with friction that decreases with speed: r / sqrt(r^2 + w^2).
local rd = require "refdyn"
local p = rd.parameters { { "w", 1e-6, "m/s" } }
local function contact(rate, level)
  local r = rate - 0.15
  return -level * (1 + 0.6 * rd.exp(-rd.abs(r) / 0.1)) * r / rd.sqrt(r * r + p.w * p.w)
end

return rd.model {
  name = "friction_masses", links = { { "a", joint = "x", mass = 1 }, { "b", joint = "x", mass = 1.7 } },
  forces = function(s)
    local pull = 60 * (s.q.b_x - s.q.a_x)
    return { a_x = -80 * s.q.a_x + pull + contact(s.qd.a_x, 3), b_x = -90 * s.q.b_x - pull + contact(s.qd.b_x, 4) }
  end,
}
