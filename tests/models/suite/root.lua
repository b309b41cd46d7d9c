-- A stiff, damped arm and a slide that rests until 0.5 s; then a force sets in whose stiffness is infinite at rest.
local rd = require "refdyn"

return rd.model {
  name = "root",
  links = {
    { "slide", joint = "x", mass = 1 },
    { "arm", joint = "psi", mass = 1, center = { 0.5, 0, 0 }, start = { psi = 0.3 }, spring = { psi = 1e5 }, damper = { psi = 1e3 } },
  },
  forces = function(s)
    local before = rd.less(s.t, 0.5)
    return { slide_x = rd.where(before, 0, 1) * (1 + rd.sqrt(rd.where(before, 1, rd.abs(s.q.slide_x)))) }
  end,
}
