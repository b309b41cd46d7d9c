-- expect: 6: ')' expected (to close '(' at line 5) near <eof>
local rd = require "refdyn"
return rd.model { name = "wrong",
  links = { { "a", joint = "x", mass = 1 } },
  forces = function(s) return { a_x = rd.max(0, s.q.a_x
