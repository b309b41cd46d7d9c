-- expect: 8: links[1].at: 2 numbers; must have 3
-- expect: 8: links[1].turn[1]: "w" is not an axis; use x, y or z
-- expect: 8: links[1].turn[2]: not a turn; must be { "x", angle }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, at = { 1, 2 }, turn = { { "w", 1 }, { 1 } }, mass = 1 },
  },
}
