-- expect: 6: links[1].turn: one turn by itself, a list of turns such as { { "x", 1.57 } } is needed
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", turn = { "x", 1 }, joint = "x", mass = 1 },
  },
}
