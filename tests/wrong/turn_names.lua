-- expect: 10: links[1].turn: has named entries (x), a list of turns such as { { "x", 1.57 } } is needed
-- expect: 11: links[2].turn: has named entries (z), a list of turns such as { { "x", 1.57 } } is needed
-- expect: 12: links[3].turn[1]: not of that form, { "x", angle } is needed
-- expect: 13: links[4].turn[1]: not of that form, { "x", angle } is needed
-- expect: 14: links[5].turn[1]: not of that form, { "x", angle } is needed
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
