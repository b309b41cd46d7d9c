-- expect: 7: links[1].turn[1]: a text, { "x", angle } is needed
-- expect: 7: links[1].turn[2]: a number, { "x", angle } is needed
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", turn = { "x", 1 }, joint = "x", mass = 1 },
  },
}
