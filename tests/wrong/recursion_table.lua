-- expect: 4: tables nested deeper than 32
local rd = require "refdyn"
local t = {}
for i = 1, 50 do t = { t } end
return rd.model { name = "wrong", links = t }
