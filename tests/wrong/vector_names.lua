-- expect: 11: links[1].at: has named entries (x, y, z); must be a list of 3 numbers such as { 0, 0, 1 }
-- expect: 12: links[2].at: has named entries (z); must be a list of 3 numbers such as { 0, 0, 1 }
-- expect: 13: links[3].center: has named entries (y); must be a list of 3 numbers such as { 0, 0, 1 }
-- expect: 14: links[4].bodies[1].size: has named entries (z); must be a list of 3 numbers such as { 0, 0, 1 }
-- expect: 15: links[5].center: 4 numbers; must have 3, with decimal points
-- expect: 17: points.E.at: has named entries (z); must be a list of 3 numbers such as { 0, 0, 1 }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "z", mass = 1, at = { x = 0, y = 0, z = 1 } },
    { "b", joint = "z", mass = 1, at = { 0, 0, 1, z = 5 } },
    { "c", joint = "z", mass = 1, center = { 0, y = 1, 0 } },
    { "d", joint = "z", bodies = { rd.box { { 1, 1, z = 1 }, mass = 1 } } },
    { "e", joint = "z", mass = 1, center = { 0, 0, 1, 2 } },
  },
  points = { E = { on = "a", at = { z = 1 } } },
}
