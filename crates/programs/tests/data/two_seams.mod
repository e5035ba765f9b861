MODULE WeldCell
  ! data as a controller saves them
  TASK PERS seamdata sm1:=[0.2,0.05,[0,0,0,0,0,0,0,0,0],0,0,0,0,0,[0,0,0,0,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0,0,[0,0,0,0,0,0,0,0,0],0.05];
  TASK PERS welddata wd1:=[6,0,[5,0,24,120,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
  TASK PERS welddata wd2:=[8,0,[5,0,24,140,0,0,0,0,0],
    [0,0,0,0,0,0,0,0,0]];
  CONST robtarget p10:=[[10,0,0],[0,1,0,0],[0,-1,0,1],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget p20:=[[60,0,0],[0,1,0,0],[0,-1,0,1],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  PERS num nParts:=14;

  PROC main()
    TPWrite "start; go!";
    MoveJ [[10,0,60],[0,1,0,0],[0,-1,0,1],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]],v200,z10,tGun\WObj:=wTable;
    rSeam;
  ENDPROC

  PROC rSeam()
    SearchL \Stop,diTouch,pFound,p10,v20,tGun\WObj:=wTable;
    ArcLStart p10,v100,sm1,wd1,fine,tGun\WObj:=wTable\SeamName:="A";
    ArcL p20,v100,sm1,wd1,z1,tGun\WObj:=wTable;
    ArcCEnd [[75,5,0],[0,1,0,0],[0,-1,0,1],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]],
      [[80,10,0],[0,1,0,0],[0,-1,0,1],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]],v100,sm1,wd2,fine,tGun\WObj:=wTable;
    WaitTime \InPos,0.5;
    SetDO doGas,0;
    MoveL [[80,10,50],[0,1,0,0],[0,-1,0,1],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]],v200,fine,tGun\WObj:=wTable;
  ENDPROC
ENDMODULE
