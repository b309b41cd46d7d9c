-- expect: 6: states: the function returns a single rd.state; must return a list of states such as { rd.state { "z", rate = expression } }, or {} for none
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, 0 },
  links = { { "a", joint = "x", mass = 1 } },
  states = function(s) return rd.state { "z", rate = 1 } end,
  forces = function(s) return { a_x = 1 } end,
}
