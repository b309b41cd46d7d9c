-- expect: 6: links[1].turn: a single turn; must be a list of turns such as { { "x", 1.57 } }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", turn = { "x", 1 }, joint = "x", mass = 1 },
  },
}
