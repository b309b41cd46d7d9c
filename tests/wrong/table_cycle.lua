-- expect: 3: tables nested deeper than 32
local rd = require "refdyn"
local t = {}
t[1] = t
return rd.model { name = "wrong", links = t }
