-- expect: 8: item 2 of a list is nil; lists must have no gaps
-- expect: 9: item 2 of a list is nil; lists must have no gaps
-- expect: 13: item 2 of a list is nil; lists must have no gaps
-- expect: 14: item 1 of a list is nil; lists must have no gaps
-- expect: 14: item 2 of a list is nil; lists must have no gaps
-- expect: 16: item 2 of a list is nil; lists must have no gaps
local rd = require "refdyn"
local course = rd.spline { { 0, 1 }, nil, { 1, 2 } }
local n = rd.option("n", 5, { 4, nil, 5 })
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "z", mass = 1, at = { 0, nil, 1 } },
    { "b", joint = { nil, "z" }, mass = 1, turn = { { "x", 1 }, nil, { "y", 1 } } },
  },
  hold = { "a_z", nil, "b_z" },
}
