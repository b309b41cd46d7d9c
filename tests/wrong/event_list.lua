-- expect: 6: events: the function returns a single rd.event; must return a list of events such as { rd.event { expression } }, or {} for none
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = { { "a", joint = "z", mass = 1 } },
  events = function(s) return rd.event { s.q.a_z } end,
}
