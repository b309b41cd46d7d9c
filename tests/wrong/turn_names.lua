-- expect: 10: links[1].turn: has named entries (x); must be a list of turns such as { { "x", 1.57 } }
-- expect: 11: links[2].turn: has named entries (z); must be a list of turns such as { { "x", 1.57 } }
-- expect: 12: links[3].turn[1]: not a turn; must be { "x", angle }
-- expect: 13: links[4].turn[1]: not a turn; must be { "x", angle }
-- expect: 14: links[5].turn[1]: not a turn; must be { "x", angle }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "z", mass = 1, turn = { x = 1 } },
    { "b", joint = "z", mass = 1, turn = { { "x", 1 }, z = 2 } },
    { "c", joint = "z", mass = 1, turn = { { "x", 1, y = 2 } } },
    { "d", joint = "z", mass = 1, turn = { { x = 1 } } },
    { "e", joint = "z", mass = 1, turn = { { "x", 1, 2 } } },
  },
}
