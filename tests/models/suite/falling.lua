-- A mass on a spring of negative stiffness -k: x'' = k x.
local rd = require "refdyn"
local p = rd.parameters { { "k", 1, "N/m" } }

return rd.model {
  name = "falling",
  links = { { "mass", joint = "x", start = { x = 0.01 }, mass = 1 } },
  forces = function(s) return { mass_x = p.k * s.q.mass_x } end,
}
