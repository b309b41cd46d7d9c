-- expect: 3: unexpected symbol near '<\1>'
local rd = require "refdyn"
local x = 1  2
