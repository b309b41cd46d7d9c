-- expect: 8: links[1].at: 2 numbers, 3 are needed
-- expect: 8: links[1].turn[1]: "w" is no axis, x y z are
-- expect: 8: links[1].turn[2]: not of that form, { "x", angle } is needed
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, at = { 1, 2 }, turn = { { "w", 1 }, { 1 } }, mass = 1 },
  },
}
