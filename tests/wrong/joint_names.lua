-- expect: 11: links[1].joint: has named entries (z); must be a list of names such as { "a", "b" }
-- expect: 12: links[2].joint: has named entries (z); must be a list of names such as { "a", "b" }
-- expect: 13: links[3].joint[2]: a truth value; must be a text
-- expect: 14: links[4].joint: "z,,x" has an empty name; write names with commas between them
-- expect: 15: links[5].joint: "z, " has an empty name; write names with commas between them
-- expect: 16: links[6].joint[1]: a table; must be a text
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "psi", z = 1 }, mass = 1, spring = { z = 2 } },
    { "b", joint = { z = true }, mass = 1 },
    { "c", joint = { "z", true }, mass = 1 },
    { "d", joint = "z,,x", mass = 1 },
    { "e", joint = "z, ", mass = 1 },
    { "f", joint = { { "z" } }, mass = 1 },
  },
}
