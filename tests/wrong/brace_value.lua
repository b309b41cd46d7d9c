-- expect: 6: unexpected symbol near <eof>; the '{' in line 5 lacks its end
local rd = require "refdyn"
return rd.model {
  name = "wrong",
  links = {
