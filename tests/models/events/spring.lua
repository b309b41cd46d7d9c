-- A mass on a spring whose stiffness jumps at the middle position; an event reports its turning points.
local rd = require "refdyn"
local p = rd.parameters { { "s", 9, "N/m" }, { "soft", 4, "N/m" }, { "x0", 1, "m" } }
return rd.model {
  name = "spring",
  links = { { "mass", joint = "x", mass = 1, start = { x = p.x0 } } },
  forces = function(s) return { mass_x = -p.s * s.q.mass_x } end,
  events = function(s)
    return {
      rd.event { s.q.mass_x, direction = "down", parameters = { s = p.soft }, name = "middle" },
      rd.event { s.qd.mass_x, direction = "up", name = "turn" },
    }
  end,
}
